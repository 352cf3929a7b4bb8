#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <variant>

#include "drivers/runtime/core/device.h"
#include "drivers/runtime/core/operation.h"
#include "drivers/tsubaki_sc/login.h"
#include "drivers/tsubaki_sc/procedure.h"
#include "drivers/tsubaki_sc/trip_reader.h"

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
inline constexpr std::string_view kSetPasswordName = "set_password";
inline constexpr std::string_view kCheckPasswordName = "check_password";

[[nodiscard]] std::span<const OperationSpec> Operations();

// What procedures work on.
struct Workshop {
  const ScSettings& settings;
  const Requests& requests;
  PasswordBook& passwords;
  Login& login;
  TripReader& trips;
  DeviceOutput& output;
};

// The procedure that carries out an order, or why there is none: arguments are checked here.
using Made = std::variant<std::unique_ptr<Procedure>, Outcome>;
[[nodiscard]] Made MakeProcedure(const Order& order, const Workshop& shop);

}  // namespace axlecast::tsubaki_sc
