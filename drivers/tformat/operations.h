#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "core/device/step.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tformat/codec.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

// One command being carried out, exchange by exchange.
class Procedure : public CommandProcedure {
 public:
  // Returns the exchange to transmit now, or Idle until the next one is due.
  [[nodiscard]] virtual Step Next(MonoNs now) const = 0;
  // The exchange that Next returned is about to be transmitted. Returns the final outcome if this ends the procedure.
  virtual std::optional<Outcome> OnStarted(Bytes request, MonoNs now) = 0;
  // The exchange ended at `end`. Returns an outcome, final or not, if there is one to report.
  virtual std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) = 0;
  // Returns whether the encoder must receive no other request now.
  [[nodiscard]] virtual bool exclusive() const { return false; }
};

// A step of a procedure.
[[nodiscard]] inline Step CommandStep(const Exchange& exchange) {
  return {.action = exchange, .priority = Priority::kCommand};
}
[[nodiscard]] inline Step WaitUntil(MonoNs until) {
  return {.action = Idle{until}, .priority = Priority::kCommand};
}

// The family's operations, named by their effect: two documents give the reset IDs different meanings (README.md).
inline constexpr std::string_view kZeroSingleTurnName = "zero_single_turn";
inline constexpr std::string_view kResetTurnsName = "reset_turns_and_errors";
inline constexpr std::string_view kClearErrorsName = "clear_errors";
inline constexpr std::string_view kEepromReadName = "eeprom_read";
inline constexpr std::string_view kEepromWriteName = "eeprom_write";
inline constexpr std::string_view kEepromBackupName = "eeprom_backup";
inline constexpr std::string_view kReadAllName = "read_all";
inline constexpr std::string_view kReadTurnsName = "read_turns";
inline constexpr std::string_view kReadIdentityName = "read_identity";

[[nodiscard]] std::span<const OperationSpec> Operations();
// Whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);

// Exchanges of a procedure that may fail in a row.
inline constexpr int kTries = 3;
// From the last request to its effect: "maximum 18 ms" (spec 9, for the zero; 8.1, for an EEPROM cell), with a
// margin.
inline constexpr MonoNs kWriteTime = 20 * kMillisecond;

// ---- the procedures ----

[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeReset(DataId id, const TFormatSettings& settings,
                                                           const DeviceOutput& output);
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeEepromRead(const Arguments& arguments,
                                                                const TFormatSettings& settings);
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeEepromWrite(const Arguments& arguments,
                                                                 const TFormatSettings& settings);
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeEepromBackup(const TFormatSettings& settings);

// Returns the procedure for a command. Checks its arguments.
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                               const TFormatSettings& settings,
                                                               const DeviceOutput& output);

// Refuses an operation that the encoder's alarms forbid. `alarms`: ALMC as it was read last, if it was read.
[[nodiscard]] Result<> CheckAlarms(std::string_view operation, std::optional<std::uint8_t> alarms);

}  // namespace axlecast::tformat
