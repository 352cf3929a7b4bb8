#include "drivers/cia406/procedures.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

using Reason = command_status_t;
using Kind = SdoResult::Kind;

constexpr MonoNs kTimeout = 2 * kSecond;
// Longer than the SDO client waits for the confirmation of a save.
constexpr MonoNs kSaveTimeout = 10 * kSecond;
constexpr int kMaxReadings = 5;

std::string Hex(std::optional<std::uint32_t> value, int digits) {
  return value ? Text("0x%0*X", digits, *value) : "not offered";
}

// "turns 3, single-turn 4096 (180.0000 deg)"
std::string PositionText(std::uint32_t position, const Cia406Settings& settings) {
  const std::uint32_t counts = position & ((std::uint32_t{1} << settings.bits) - 1);
  const std::string single_turn = Text("single-turn %u (%.4f deg)", counts, Degrees(counts, settings.bits));
  return settings.turn_bits == 0 ? single_turn : Text("turns %u, ", position >> settings.bits) + single_turn;
}

// Returns whether an encoder at rest that was set to `target` may read `position`.
bool IsNear(std::uint32_t position, std::uint32_t target, const Cia406Settings& settings) {
  return CircularDistance(position, target, std::int64_t{1} << settings.total_bits()) <=
         PresetToleranceCounts(settings.bits);
}

std::string AbortReason(const SdoResult& result) {
  return Text("%s (0x%08X)", AbortText(result.value), result.value);
}

constexpr const char* kPositionRefused = "the encoder does not permit to read its position 6004h";

}  // namespace

// ---- readouts ----

std::optional<SdoRequest> Readout::NextRequest(MonoNs) const {
  if (values_.size() == objects_.size()) return std::nullopt;
  return SdoRequest{.object = objects_[values_.size()], .write = {}};
}

std::optional<Outcome> Readout::OnResult(const SdoResult& result) {
  if (result.request.object != objects_[values_.size()] || result.request.write) return std::nullopt;
  const MonoNs now = result.received.last;
  if (result.kind == Kind::kTimedOut) return OnTime(now);
  values_.push_back(result.kind == Kind::kValue ? std::optional(result.value) : std::nullopt);
  if (values_.size() < objects_.size()) return std::nullopt;
  return show_(values_, now);
}

std::optional<Outcome> Readout::OnTime(MonoNs now) {
  if (now < deadline_) return std::nullopt;
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "the encoder did not answer in time");
}

Outcome Readout::OnLinkLost() const {
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "the link was lost before all was read");
}

// A shaft that turns may have left the place where it was set.
std::unique_ptr<Procedure> ReadPosition(std::optional<std::uint32_t> target, const Cia406Settings& settings,
                                        const DeviceOutput& output, MonoNs deadline) {
  const auto show = [target, &settings, &output](const Readout::Values& values, MonoNs now) {
    if (!values[0]) return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED, kPositionRefused);
    Outcome outcome = Verified(PositionText(*values[0], settings));
    outcome.changes.push_back({"position", "", std::to_string(*values[0])});
    if (!target) return outcome;
    const bool near = IsNear(*values[0], *target, settings);
    outcome.changes.push_back(FindingChange(FindingWord(near, AtRest(output, now))));
    return outcome;
  };
  return std::make_unique<Readout>(std::vector{kPosition}, deadline, show);
}

std::unique_ptr<Procedure> ReadIdentity(MonoNs deadline) {
  const auto show = [](const Readout::Values& values, MonoNs) {
    const std::uint32_t type = values[0].value_or(0);
    Outcome outcome = Verified(Text("device type 0x%08X: profile %u", type, type & 0xFFFF));
    for (std::size_t part = 0; part < kIdentityParts; ++part) {
      outcome.changes.push_back({kIdentityNames.at(part), "", Hex(values[part + 1], 8)});
    }
    return outcome;
  };
  return std::make_unique<Readout>(std::vector{kDeviceType, kVendor, kProduct, kRevision, kSerial}, deadline, show);
}

std::unique_ptr<Procedure> ReadState(const Interpreter& interpreter, MonoNs deadline) {
  const auto show = [&interpreter](const Readout::Values& values, MonoNs) {
    const NodeWatch& watch = interpreter.watch();
    std::string text = std::string("NMT state ") + (watch.state() ? NmtStateName(*watch.state()) : "not known");
    if (!watch.reported()) text += " (not from a heartbeat)";
    text += "; errors: " + (values[0] ? ErrorRegisterText(static_cast<std::uint8_t>(*values[0])) : "not offered");
    if (const auto& emergency = interpreter.alarms().last_emergency()) {
      text += Text("; last EMCY 0x%04X (%s), register 0x%02X, data %s", unsigned{emergency->code},
                   EmergencyClass(emergency->code), unsigned{emergency->error_register},
                   HexText(emergency->specific).c_str());
    }
    Outcome outcome = Verified(text);
    outcome.changes = {{"error_register", "", Hex(values[0], 2)},
                       {"operating_status", "", Hex(values[1], 4)},
                       {"alarms", "", Hex(values[2], 4)},
                       {"warnings", "", Hex(values[3], 4)}};
    return outcome;
  };
  return std::make_unique<Readout>(std::vector{kErrorRegister, kOperatingStatus, kAlarms, kWarnings}, deadline,
                                   show);
}

// ---- WriteProcedure ----

WriteProcedure::WriteProcedure(const Cia406Settings& settings, MonoNs now, MonoNs write_timeout)
    : settings_(settings), write_timeout_(write_timeout), deadline_(now + kTimeout + 4 * settings.sdo_timeout) {}

void WriteProcedure::OnStarted(const SdoRequest& request, MonoNs now) {
  if (!request.write || stage_ != Stage::kWrite) return;
  stage_ = Stage::kSent;
  deadline_ = now + write_timeout_;
}

void WriteProcedure::OnNotSent() {
  if (stage_ == Stage::kSent) stage_ = Stage::kWrite;
}

Outcome WriteProcedure::Unknown(std::string text) const {
  return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY, std::move(text));
}

Outcome WriteProcedure::OnLinkLost() const {
  if (touched()) return Unknown(LinkLostText());
  return Final(CommandState::kFailed, Reason::REASON_NO_REPLY, "nothing was done: the link was lost before it");
}

// ---- SaveProcedure ----

SaveProcedure::SaveProcedure(const Cia406Settings& settings, MonoNs now)
    : WriteProcedure(settings, now, kSaveTimeout) {}

std::optional<SdoRequest> SaveProcedure::NextRequest(MonoNs) const {
  if (stage_ == Stage::kRead) return SdoRequest{.object = kStoreAll, .write = {}};
  if (stage_ == Stage::kWrite) return SdoRequest{.object = kStoreAll, .write = kSaveSignature};
  return std::nullopt;
}

std::optional<Outcome> SaveProcedure::OnResult(const SdoResult& result) {
  if (result.request.object != kStoreAll) return std::nullopt;
  if (stage_ == Stage::kSent) return OnSaved(result);
  if (result.kind == Kind::kTimedOut) return OnTime(result.received.last);
  if (result.kind == Kind::kValue && (result.value & kSavesOnCommand) != 0) {
    stage_ = Stage::kWrite;
    return std::nullopt;
  }
  return Rejected(Reason::REASON_DEVICE_REFUSED, "the encoder does not store parameters on command (1010h sub 1)");
}

std::optional<Outcome> SaveProcedure::OnSaved(const SdoResult& result) const {
  if (result.kind == Kind::kWritten) {
    return Succeeded(false,
                     "the encoder confirms that it has stored its parameters; what is stored cannot be read");
  }
  if (result.kind == Kind::kAborted) {
    return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                 "the encoder did not store its parameters: " + AbortReason(result));
  }
  return Unknown(
      "the encoder did not confirm in time that it has stored its parameters; nothing shows whether it has");
}

std::optional<Outcome> SaveProcedure::OnTime(MonoNs now) {
  if (now < deadline_) return std::nullopt;
  if (!touched()) return Rejected(Reason::REASON_NO_REPLY, "the encoder did not answer");
  return Unknown(
      "the encoder restarted or became silent while it stored its parameters; nothing shows whether it has");
}

const char* SaveProcedure::LinkLostText() const {
  return "the link was lost while the encoder stored its parameters; nothing shows whether it has";
}

// ---- PresetProcedure ----

PresetProcedure::PresetProcedure(std::uint32_t target, const Cia406Settings& settings, const DeviceOutput& output,
                                 MonoNs now)
    : WriteProcedure(settings, now, kTimeout + 4 * settings.sdo_timeout), target_(target), output_(output) {}

std::optional<SdoRequest> PresetProcedure::NextRequest(MonoNs now) const {
  if (stage_ == Stage::kWrite && AtRest(output_, now)) return SdoRequest{.object = kPreset, .write = target_};
  const bool reads = stage_ == Stage::kRead || (stage_ == Stage::kVerify && now >= effect_from_);
  return reads ? std::optional(SdoRequest{.object = kPosition, .write = {}}) : std::nullopt;
}

MonoNs PresetProcedure::Due(MonoNs now) const {
  return stage_ == Stage::kVerify && now < effect_from_ ? effect_from_ : deadline_;
}

std::optional<Outcome> PresetProcedure::OnResult(const SdoResult& result) {
  if (stage_ == Stage::kSent && result.request.object == kPreset) return OnWritten(result);
  if (result.request.object != kPosition || result.request.write) return std::nullopt;
  return result.kind == Kind::kTimedOut ? OnTime(result.received.last) : OnRead(result);
}

std::optional<Outcome> PresetProcedure::OnRead(const SdoResult& result) {
  if (stage_ != Stage::kRead && stage_ != Stage::kVerify) return std::nullopt;
  if (result.kind != Kind::kValue) {
    if (!touched()) return Rejected(Reason::REASON_DEVICE_REFUSED, kPositionRefused);
    return WithBefore(Final(CommandState::kIndeterminate, Reason::REASON_DEVICE_REFUSED,
                            std::string("the preset was sent, but ") + kPositionRefused),
                      "");
  }
  if (stage_ == Stage::kVerify) {
    return result.sent.first < effect_from_ ? std::nullopt : Verify(result.value);
  }
  if (!AtRest(output_, result.received.last)) return NotAtRest(output_.MotionAt(result.received.last));
  before_ = result.value;
  stage_ = Stage::kWrite;
  return std::nullopt;
}

// The changes of this progress are needed if this process dies: a later reading shows an effect only if the position
// before is known.
std::optional<Outcome> PresetProcedure::OnWritten(const SdoResult& result) {
  if (result.kind == Kind::kAborted) {
    return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                 "nothing was changed: the encoder refuses the preset: " + AbortReason(result));
  }
  confirmed_ = result.kind == Kind::kWritten;
  stage_ = Stage::kVerify;
  effect_from_ = result.received.last + settings_.preset_settle;
  deadline_ = effect_from_ + write_timeout_;
  Outcome running;
  running.text = "the preset was sent; waiting for a reading that shows its effect";
  running.progress = 0.5F;
  return WithBefore(std::move(running), "");
}

std::optional<Outcome> PresetProcedure::Verify(std::uint32_t position) {
  const bool near = IsNear(position, target_, settings_);
  if (!near && ++readings_ < kMaxReadings) return std::nullopt;
  const std::string was = Text("the position was %u and reads %u, set to %u", before_, position, target_);
  Outcome outcome = near ? ReadBackOutcome({.same_before = SameBefore(), .confirmed = confirmed_}, was)
                         : Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                                 was + ": hold the axis; does the encoder accept a preset?");
  return WithBefore(std::move(outcome), std::to_string(position));
}

Outcome PresetProcedure::WithBefore(Outcome outcome, const std::string& after) const {
  outcome.changes.push_back({"position", std::to_string(before_), after});
  return WithFindingBefore(std::move(outcome), SameBefore());
}

bool PresetProcedure::SameBefore() const {
  return CannotBeToldApart(before_, target_, PresetToleranceCounts(settings_.bits),
                           std::int64_t{1} << settings_.total_bits());
}

std::optional<Outcome> PresetProcedure::OnTime(MonoNs now) {
  if (stage_ == Stage::kWrite && !AtRest(output_, now)) return NotAtRest(output_.MotionAt(now));
  if (now < deadline_) return std::nullopt;
  if (!touched()) return Rejected(Reason::REASON_NO_REPLY, "the encoder did not answer");
  return Unknown(
      "the preset was sent, but no reading came that shows its effect: read_position when the encoder answers "
      "again");
}

Outcome PresetProcedure::Unknown(std::string text) const {
  return WithBefore(WriteProcedure::Unknown(std::move(text)), "");
}

const char* PresetProcedure::LinkLostText() const {
  return "the link was lost after the preset and before its effect could be read: read_position when the link is "
         "back";
}

}  // namespace axlecast::cia406
