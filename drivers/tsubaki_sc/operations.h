#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/kit/refusal.h"
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
// How a start is refused by a motor with this status (AI 201).
[[nodiscard]] Outcome RefusedByTrip(std::int32_t status);
// Why the unit, as it was read last, forbids the operation.
[[nodiscard]] std::optional<Outcome> RefusalByState(std::string_view operation, const MotorReading& reading);

// What procedures work on. Outlives them.
struct OperationContext {
  const ScSettings& settings;
  const Requests& requests;
  PasswordTable& passwords;
  Login& login;
  TripReader& trips;
  DeviceOutput& output;
};

// The procedure that carries out an order, or why there is none: arguments are checked here.
using Made = axlecast::Made<Procedure>;
[[nodiscard]] Made MakeProcedure(const DriverCommand& order, const OperationContext& shop);

}  // namespace axlecast::tsubaki_sc
