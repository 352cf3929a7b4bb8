#pragma once

#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/tsubaki_sc/access.h"
#include "drivers/tsubaki_sc/procedure.h"
#include "drivers/tsubaki_sc/trips.h"

namespace axlecast::tsubaki_sc {

// Operations that the device or the configuration treats specially. All are named by their effect.
inline constexpr std::string_view kStopMotorName = "stop_motor";
inline constexpr std::string_view kStartMotorName = "start_motor";
inline constexpr std::string_view kLogInName = "log_in";
inline constexpr std::string_view kLogOutName = "log_out";
inline constexpr std::string_view kCheckPasswordName = "check_password";

[[nodiscard]] std::span<const OperationSpec> Operations();

// Returns whether the unit executes the operation only while it is logged in: guideline 6, note 1.
[[nodiscard]] bool NeedsLogin(std::string_view operation);
// Returns whether the configuration of a unit permits an operation of the family.
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

using MadeProcedure = Result<std::unique_ptr<Procedure>>;

// Returns the procedure for a command, or an error with a REASON_* if an argument is wrong or the configuration forbids it.
[[nodiscard]] MadeProcedure MakeProcedure(const DriverCommand& command, const OperationContext& context);

// ---- the operations by subject, each with the function that returns its procedure ----

struct Operation {
  OperationSpec spec;
  MadeProcedure (*make)(const DriverCommand& command, const OperationContext& context);
};
[[nodiscard]] std::vector<Operation> MotorOperations();
[[nodiscard]] std::vector<Operation> TripOperations();
[[nodiscard]] std::vector<Operation> ParameterOperations();
[[nodiscard]] std::vector<Operation> AccessOperations();

}  // namespace axlecast::tsubaki_sc
