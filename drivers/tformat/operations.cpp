#include "drivers/tformat/operations.h"

#include <axlecast/command_status_t.hpp>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/tformat/alarms.h"
#include "drivers/tformat/eeprom_read.h"
#include "drivers/tformat/eeprom_write.h"
#include "drivers/tformat/readout.h"
#include "drivers/tformat/reset_procedure.h"

namespace axlecast::tformat {
namespace {

using Made = Result<std::unique_ptr<Procedure>>;

// TS5669 spec 6.1.1: one rewrite for each cell that is written.
std::int32_t CellWrites(const Arguments& arguments) {
  const auto data = HexArgument(arguments, "data");
  return data ? static_cast<std::int32_t>(data->size()) : 0;
}

const std::vector<OperationSpec>& Specs() {
  static const std::vector<OperationSpec> kSpecs = {
      {.name = kZeroSingleTurnName,
       .help = "Makes the present shaft angle the encoder's single-turn 0 (ID 8, ten requests); writes its EEPROM",
       .arguments = {},
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .writes = &OneWrite,
       .verification = "ID 3 reads single-turn 0 +- 0.35 degrees, if it read otherwise before",
       .verified_by_operation = kReadAllName},
      {.name = kResetTurnsName,
       .help = "Sets the multi-turn counter to 0 and clears all latched errors (ID C, ten requests)",
       .arguments = {},
       .destructive = true,
       .needs_standstill = true,
       .needs_permit = true,
       .moves_datum = true,
       .verification = "ID 3 reads turns 0 and no latched error, if it read otherwise before",
       .verified_by_operation = kReadAllName},
      {.name = kClearErrorsName,
       .help =
           "Clears all latched errors (ID 7, ten requests); position and turns stay, and so does a lost reference",
       .arguments = {},
       .verification = "ID 3 reads no latched error, if one stood before",
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
       .arguments = {},
       .reads_only = true,
       .verification = "each cell by its own reply with ID D"},
      {.name = kReadAllName,
       .help = "Reads position, turns, encoder ID and alarms once (ID 3)",
       .arguments = {kAfterArgument},
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kReadTurnsName,
       .help = "Reads the multi-turn counter once (ID 1)",
       .arguments = {},
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kReadIdentityName,
       .help = "Reads the encoder ID once (ID 2), of whichever encoder is connected",
       .arguments = {},
       .reads_only = true,
       .verification = "it is a reading"},
  };
  return kSpecs;
}

std::optional<std::size_t> AddressArgument(const Arguments& arguments) {
  const auto address = WholeArgument(arguments, "address", 0, kEepromCells - 1);
  return address ? std::optional(static_cast<std::size_t>(*address)) : std::nullopt;
}

Made MakeEepromWrite(const Arguments& arguments, const TFormatSettings& settings) {
  const auto address = AddressArgument(arguments);
  if (!address) return BadArgument("address must be 0 to 79");
  auto data = HexArgument(arguments, "data");
  if (!data) return BadArgument("data must be bytes in hex, two digits each, e.g. \"A1 05\"");
  if (*address + data->size() > kEepromCells) {
    return BadArgument(Text("%zu bytes from address %zu do not fit the cells 0 to 79", data->size(), *address));
  }
  for (std::size_t cell = *address; cell < *address + data->size(); ++cell) {
    if (!settings.eeprom_writable[cell]) {
      return NotPermitted(Text("the configuration does not list EEPROM address %zu in eeprom_writable", cell));
    }
  }
  return std::make_unique<EepromWrite>(*address, std::move(*data), settings.timeout);
}

// Verifies the write that `after` names.
Made MakeEepromLook(const CommandLine& after, const TFormatSettings& settings) {
  const auto address = AddressArgument(after.arguments);
  auto data = HexArgument(after.arguments, "data");
  if (after.operation != kEepromWriteName || !address || !data || *address + data->size() > kEepromCells) {
    return BadArgument("after must be an eeprom_write with its address and data");
  }
  const std::size_t count = data->size();
  return std::make_unique<EepromRead>(*address, count, std::move(data), settings.timeout);
}

Made MakeEepromRead(const Arguments& arguments, const TFormatSettings& settings) {
  if (const auto after = AfterArgument(arguments)) return MakeEepromLook(*after, settings);
  const auto address = AddressArgument(arguments);
  if (!address) return BadArgument("address must be 0 to 79");
  const auto maximum = static_cast<std::int64_t>(kEepromCells - *address);
  const auto count = ParseWhole(FindArgument(arguments, "count").value_or("1"), 1, maximum);
  if (!count) return BadArgument(Text("count must be 1 to %zu: the last cell is 79", kEepromCells - *address));
  return std::make_unique<EepromRead>(*address, static_cast<std::size_t>(*count), std::nullopt, settings.timeout);
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
  const auto reset = [&](DataId id) -> Made { return std::make_unique<ResetProcedure>(id, settings, output); };
  const auto read = [&](DataId id) -> Made { return std::make_unique<Readout>(id, "", settings, output); };
  const std::string_view name = command.operation;
  if (name == kZeroSingleTurnName) return reset(DataId::kZeroSingleTurn);
  if (name == kResetTurnsName) return reset(DataId::kResetTurnsAndErrors);
  if (name == kClearErrorsName) return reset(DataId::kClearErrors);
  if (name == kEepromReadName) return MakeEepromRead(command.arguments, settings);
  if (name == kEepromWriteName) return MakeEepromWrite(command.arguments, settings);
  if (name == kEepromBackupName) {
    return std::make_unique<EepromRead>(0, kEepromCells, std::nullopt, settings.timeout);
  }
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
