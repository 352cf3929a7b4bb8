#include "drivers/tsubaki_sc/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>

#include "core/config/machine_config.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tsubaki_sc/interpreter.h"

namespace axlecast::tsubaki_sc {
namespace {

const std::vector<Operation>& All() {
  static const std::vector<Operation> kAll = [] {
    std::vector<Operation> all;
    for (const auto& some : {MotorOperations(), TripOperations(), ParameterOperations(), AccessOperations()}) {
      all.insert(all.end(), some.begin(), some.end());
    }
    return all;
  }();
  return kAll;
}

}  // namespace

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kSpecs = [] {
    std::vector<OperationSpec> specs;
    for (const Operation& operation : All()) specs.push_back(operation.spec);
    return specs;
  }();
  return kSpecs;
}

bool NeedsLogin(std::string_view operation) {
  const OperationSpec* spec = FindOperation(Operations(), operation);
  return spec != nullptr && !spec->reads_only && operation != kLogInName && operation != kLogOutName;
}

bool Permits(const BusConfig&, const DeviceConfig& device, std::string_view operation) {
  const auto& settings = static_cast<const ScSettings&>(*device.settings);
  if (operation == kStopMotorName) return settings.motor_control != MotorControl::kNone;
  if (operation == kStartMotorName) return settings.motor_control == MotorControl::kStartStop;
  if (operation == kLogOutName && settings.StaysLoggedIn()) return false;
  const bool password = NeedsLogin(operation) || operation == kLogInName || operation == kLogOutName ||
                        operation == kCheckPasswordName;
  return !password || !settings.password.empty();
}

Result<> CheckNotTripped(std::int32_t status) {
  if ((status & kTripBits) == 0) return {};
  return Failure(
      "the motor is tripped (" + StatusText(status) + "), and does not start then; clear the cause first",
      command_status_t::REASON_DEVICE_ALARM);
}

MadeProcedure MakeProcedure(const DriverCommand& command, const OperationContext& context) {
  const std::string_view name = command.operation;
  const auto found =
      std::find_if(All().begin(), All().end(), [&](const Operation& known) { return known.spec.name == name; });
  if (found == All().end()) return UnknownOperation("tsubaki_sc", name);
  // A stop or a start without a password is refused because it has no motor_control.
  const bool motor = name == kStopMotorName || name == kStartMotorName;
  const bool password = !motor && (NeedsLogin(name) || name == kCheckPasswordName);
  if (password && context.passwords.active().empty()) {
    return NotPermitted("the configuration names no password: add passwords and password");
  }
  return found->make(command, context);
}

}  // namespace axlecast::tsubaki_sc
