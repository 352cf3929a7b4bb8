#include "drivers/tformat/operations.h"

#include <axlecast/command_status_t.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/config/machine_config.h"
#include "drivers/kit/arguments.h"

namespace axlecast::tformat {
namespace {

// One readout, shown: ID 1, 2 or 3.
class Readout final : public Procedure {
 public:
  // With `after`, the name of a reset, the change `finding` reports whether the reset took effect (ID 3).
  Readout(DataId id, std::string after, const TFormatSettings& settings, const DeviceOutput& output)
      : id_(id), after_(std::move(after)), settings_(settings), output_(output) {}

  [[nodiscard]] Step Next(MonoNs) const override { return CommandStep(Ask(id_, settings_.timeout)); }
  std::optional<Outcome> OnStarted(Bytes, MonoNs) override { return std::nullopt; }
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override {
    // An encoder of another model is what read_identity is asked about.
    const bool identity = id_ == DataId::kEncoderId && answer.error == ErrorKind::kWrongIdentity;
    if (!answer.ok() && !identity) {
      if (++failures_ < kTries) return std::nullopt;
      return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
                   Text("the reading failed %d times (%s)", failures_, ErrorName(*answer.error)));
    }
    end_ = end;
    return Show(answer.reply);
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    return Final(CommandState::kFailed, command_status_t::REASON_NO_REPLY,
                 "the link was lost before the reading came");
  }

 private:
  [[nodiscard]] Outcome Show(const Reply& reply) const {
    if (id_ == DataId::kAll) return ShowAll(reply);
    Outcome outcome;
    if (id_ == DataId::kEncoderId) {
      outcome = Verified(Text("encoder ID 0x%02X, model %s has 0x%02X", unsigned{*reply.encoder_id},
                              settings_.model.c_str(), unsigned{settings_.encoder_id}));
      outcome.changes.push_back({"encoder_id", "", Text("0x%02X", unsigned{*reply.encoder_id})});
    } else {
      outcome = Verified(Text("turns %u", *reply.multi_turn));
      outcome.changes.push_back({"turns", "", std::to_string(*reply.multi_turn)});
    }
    return outcome;
  }
  [[nodiscard]] Outcome ShowAll(const Reply& reply) const {
    Outcome outcome = Verified(
        Text("single-turn %u (%.4f deg), turns %u, encoder ID 0x%02X, SF 0x%02X, ALMC %s", *reply.single_turn,
             Degrees(*reply.single_turn, settings_.format.single_turn_bits), *reply.multi_turn,
             unsigned{*reply.encoder_id}, unsigned{*reply.status}, AlarmText(*reply.alarms).c_str()));
    outcome.changes.push_back({"single_turn", "", std::to_string(*reply.single_turn)});
    outcome.changes.push_back({"turns", "", std::to_string(*reply.multi_turn)});
    outcome.changes.push_back({"alarms", "", AlarmText(*reply.alarms)});
    if (after_.empty())
      outcome.changes.push_back({"encoder_id", "", Text("0x%02X", unsigned{*reply.encoder_id})});
    else
      outcome.changes.push_back(FindingChange(Finding(reply, end_)));
    return outcome;
  }
  // A shaft that turns may have left the place where it was zeroed. The cause of an alarm latches it again.
  [[nodiscard]] const char* Finding(const Reply& all, MonoNs now) const {
    const bool at_rest = AtRest(output_, now);
    const int latched = settings_.turns_range > 0 ? kLatchedAlarms : kLatchedAlarms & ~kMultiTurnAlarms;
    const bool clear = (*all.alarms & latched) == 0;
    if (after_ == kZeroSingleTurnName) return FindingWord(IsZero(all, settings_), at_rest);
    if (after_ != kResetTurnsName) return FindingWord(clear, false);
    const bool reset = TurnsAreReset(all, settings_);
    return FindingWord(reset && clear, at_rest && !reset);
  }

  DataId id_;
  std::string after_;
  const TFormatSettings& settings_;
  const DeviceOutput& output_;
  MonoNs end_ = 0;
  int failures_ = 0;
};

using Made = Result<std::unique_ptr<Procedure>>;

// TS5669 spec 6.1.1: one rewrite for each cell that is written.
std::int32_t CellWrites(const Arguments& arguments) {
  const auto data = HexArgument(arguments, "data");
  return data ? static_cast<std::int32_t>(data->size()) : 0;
}

const std::vector<OperationSpec>& Specs() {
  static const std::vector<OperationSpec> kSpecs = {
      MovingDatum(
          {.name = kZeroSingleTurnName,
           .help =
               "Makes the present shaft angle the encoder's single-turn 0 (ID 8, ten requests); writes its EEPROM",
           .verification = "ID 3 reads single-turn 0 +- 0.35 degrees, if it read otherwise before",
           .verified_by_operation = kReadAllName}),
      {.name = kResetTurnsName,
       .help = "Sets the multi-turn counter to 0 and clears all latched errors (ID C, ten requests)",
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .verification = "ID 3 reads turns 0 and no latched error, if it read otherwise before",
       .verified_by_operation = kReadAllName},
      {.name = kClearErrorsName,
       .help =
           "Clears all latched errors (ID 7, ten requests); position and turns stay, and so does a lost reference",
       .verification = "ID 3 reads no latched error, if one was latched before",
       .verified_by_operation = kReadAllName},
      {.name = kEepromReadName,
       .help = "Reads cells of the user EEPROM",
       .arguments = {{"address", "0 to 79; needed unless `after` is given", false},
                     {"count", "1 to 80 cells, default 1", false},
                     kAfterArgument},
       .reads_only = true,
       .verification = "each cell by its own reply with ID D"},
      {.name = kEepromWriteName,
       .help =
           "Writes cells of the user EEPROM that the configuration lists in eeprom_writable; all 80 cells are read "
           "first and reported",
       .arguments = {{"address", "0 to 79"}, {"data", "bytes in hex, e.g. \"A1 05\""}},
       .destructive = true,
       .writes = &CellWrites,
       .verification = "each cell is read back with ID D",
       .verified_by_operation = kEepromReadName},
      {.name = kEepromBackupName,
       .help = "Reads all 80 cells of the user EEPROM",
       .reads_only = true,
       .verification = "each cell by its own reply with ID D"},
      {.name = kReadAllName,
       .help = "Reads position, turns, encoder ID and alarms once (ID 3)",
       .arguments = {kAfterArgument},
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kReadTurnsName,
       .help = "Reads the multi-turn counter once (ID 1)",
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kReadIdentityName,
       .help = "Reads the encoder ID once (ID 2), of whichever encoder is connected",
       .reads_only = true,
       .verification = "it is a reading"},
  };
  return kSpecs;
}

Made MakeReadAll(const Arguments& arguments, const TFormatSettings& settings, const DeviceOutput& output) {
  std::string after;
  if (const auto line = AfterArgument(arguments)) {
    after = line->operation;
    if (after != kZeroSingleTurnName && after != kResetTurnsName && after != kClearErrorsName) {
      return BadArgument("after must be zero_single_turn, reset_turns_and_errors or clear_errors");
    }
  }
  return std::make_unique<Readout>(DataId::kAll, std::move(after), settings, output);
}

}  // namespace

bool Permits(const BusConfig&, const DeviceConfig& device, std::string_view operation) {
  return operation != kEepromWriteName ||
         static_cast<const TFormatSettings&>(*device.settings).eeprom_writable.any();
}

std::span<const OperationSpec> Operations() { return Specs(); }

Made MakeProcedure(const DriverCommand& command, const TFormatSettings& settings, const DeviceOutput& output) {
  const auto read = [&](DataId id) -> Made { return std::make_unique<Readout>(id, "", settings, output); };
  const std::string_view name = command.operation;
  if (name == kZeroSingleTurnName) return MakeReset(DataId::kZeroSingleTurn, settings, output);
  if (name == kResetTurnsName) return MakeReset(DataId::kResetTurnsAndErrors, settings, output);
  if (name == kClearErrorsName) return MakeReset(DataId::kClearErrors, settings, output);
  if (name == kEepromReadName) return MakeEepromRead(command.arguments, settings);
  if (name == kEepromWriteName) return MakeEepromWrite(command.arguments, settings);
  if (name == kEepromBackupName) return MakeEepromBackup(settings);
  if (name == kReadAllName) return MakeReadAll(command.arguments, settings, output);
  if (name == kReadTurnsName) return read(DataId::kMultiTurn);
  if (name == kReadIdentityName) return read(DataId::kEncoderId);
  return UnknownOperation("tformat", command.operation);
}

Result<> CheckAlarms(std::string_view operation, std::optional<std::uint8_t> alarms) {
  const auto doubtful = static_cast<std::uint8_t>(alarms.value_or(0) & (kAlmCountingError | kAlmFullAbsolute));
  if (operation != kZeroSingleTurnName || doubtful == 0) return {};
  return Failure("the single-turn position is in doubt (ALMC " + AlarmText(*alarms) + "); clear the cause first",
                 command_status_t::REASON_DEVICE_ALARM);
}

}  // namespace axlecast::tformat
