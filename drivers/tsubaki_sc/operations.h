#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/tsubaki_sc/access.h"
#include "drivers/tsubaki_sc/procedure.h"
#include "drivers/tsubaki_sc/trips.h"

namespace axlecast::tsubaki_sc {

// The family's operations, named by their effect.
inline constexpr std::string_view kClearTripCountName = "clear_trip_count";
inline constexpr std::string_view kStopMotorName = "stop_motor";
inline constexpr std::string_view kStartMotorName = "start_motor";
inline constexpr std::string_view kReadStateName = "read_state";
inline constexpr std::string_view kReadSetValuesName = "read_set_values";
inline constexpr std::string_view kReadIdentityName = "read_identity";
inline constexpr std::string_view kReadParameterName = "read_parameter";
inline constexpr std::string_view kReadParametersName = "read_parameters";
inline constexpr std::string_view kWriteParameterName = "write_parameter";
inline constexpr std::string_view kWriteParametersName = "write_parameters";
inline constexpr std::string_view kFetchTripLogsName = "fetch_trip_logs";
inline constexpr std::string_view kLogInName = "log_in";
inline constexpr std::string_view kLogOutName = "log_out";
inline constexpr std::string_view kSetPasswordName = "set_password";
inline constexpr std::string_view kCheckPasswordName = "check_password";

[[nodiscard]] std::span<const OperationSpec> Operations();

// Guideline 6, note 1: what the unit does only while it is logged in.
[[nodiscard]] bool NeedsLogin(std::string_view operation);
// Whether the configuration of a unit permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);
// Refuses to start a tripped motor; `status` is its motor status (AI 201).
[[nodiscard]] Result<> CheckNotTripped(std::int32_t status);

// What procedures use. It outlives them.
struct OperationContext {
  const ScSettings& settings;
  const Requests& requests;
  PasswordTable& passwords;
  Login& login;
  TripReader& trips;
  DeviceOutput& output;
};

// Returns the procedure for a command, or an error with a REASON_* if an argument is wrong or the configuration forbids it.
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                               const OperationContext& context);

}  // namespace axlecast::tsubaki_sc
