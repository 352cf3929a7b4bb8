#include "drivers/tsubaki_sc/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/tsubaki_sc/alarms.h"
#include "drivers/tsubaki_sc/parameters.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

const ArgumentSpec kAfter = {"after", "an operation with its arguments, to see whether it took effect", false};

std::vector<ArgumentSpec> ParameterArguments() {
  std::vector<ArgumentSpec> arguments;
  for (const ParameterSpec& parameter : Parameters()) {
    arguments.push_back({parameter.name, parameter.help, false});
  }
  return arguments;
}

std::vector<OperationSpec> MotorOperations() {
  return {
      {.name = kStopMotorName,
       .help = "Stops the motor (coil 100), before everything else on the bus. Not an emergency stop",
       .verification = "coil 100 reads 1; whether the motor stands cannot be read",
       .verified_by_operation = kReadStateName,
       .urgent = true},
      {.name = kStartMotorName,
       .help = "Starts the motor again (coil 200); not while it is tripped",
       .needs_permit = true,
       .verification = "coil 100 reads 0, if it read 1 before; whether the motor turns cannot be read",
       .verified_by_operation = kReadStateName},
      {.name = kClearTripCountName,
       .help = "Sets the trip count to 0 (coil 0); trip factors and logs stay",
       .destructive = true,
       .verification = "the trip count reads 0",
       .verified_by_operation = kReadStateName},
      {.name = kReadStateName,
       .help = "Reads trip count, motor status, stop coil, login and mains frequency once",
       .arguments = {kAfter},
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kFetchTripLogsName,
       .help = "Reads the curves of the last three trips at once and publishes them; live data of the bus wait",
       .reads_only = true,
       .verification = "the trip count is the same before and after each log"},
  };
}

std::vector<OperationSpec> ParameterOperations() {
  return {
      {.name = kReadSetValuesName,
       .help = "Reads the limits and times that hold at the present DIP switch setting and mains frequency",
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kReadParameterName,
       .help = "Reads one parameter",
       .arguments = {{"name", "e.g. power_upper_a_1_50hz; the family's README lists all 55"}},
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kReadParametersName,
       .help = "Reads up to four parameters, or all 55 as registers in hex",
       .arguments = {{"names", "up to four, e.g. start_time_1,log_interval; leave it out for all", false}, kAfter},
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kWriteParameterName,
       .help = "Writes one parameter",
       .arguments = {{"name", "e.g. power_upper_a_1_50hz"}, {"value", "in its unit, e.g. 125.0"}},
       .destructive = true,
       .verification = "it is read back",
       .verified_by_operation = kReadParametersName},
      {.name = kWriteParametersName,
       .help =
           "Writes up to 16 parameters, each given as name=value in its unit; all are checked before any is sent",
       .arguments = ParameterArguments(),
       .destructive = true,
       .verification = "all are read back",
       .verified_by_operation = kReadParametersName},
  };
}

std::vector<OperationSpec> AccessOperations() {
  return {
      {.name = kReadIdentityName,
       .help = "Reads product code, MFG number and software version",
       .reads_only = true,
       .verification = "it is a reading"},
      {.name = kLogInName,
       .help = "Logs the unit in with the password in use, until log_out; also after one that was wrong",
       .verification = "AI 300 reads FF00"},
      {.name = kLogOutName,
       .help = "Logs the unit out with the password in use",
       .verification = "AI 300 reads 0000"},
      {.name = kSetPasswordName,
       .help = "Gives the unit the password that the configuration knows by this name, and uses it from then on",
       .arguments = {{"name", "a NAME of passwords in the configuration, never a password"}},
       .destructive = true,
       .verification = "it is read back and compared",
       .verified_by_operation = kCheckPasswordName},
      {.name = kCheckPasswordName,
       .help = "Compares the unit's password with the one of this name; the unit must be logged in",
       .arguments = {{"name", "a NAME of passwords in the configuration; needed unless `after` is given", false},
                     kAfter},
       .reads_only = true,
       .verification = "it is a reading"},
  };
}

}  // namespace

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kSpecs = [] {
    std::vector<OperationSpec> all;
    for (const auto& some : {MotorOperations(), ParameterOperations(), AccessOperations()}) {
      all.insert(all.end(), some.begin(), some.end());
    }
    return all;
  }();
  return kSpecs;
}

bool NeedsLogin(std::string_view operation) {
  const auto specs = Operations();
  const auto found =
      std::find_if(specs.begin(), specs.end(), [&](const auto& spec) { return spec.name == operation; });
  return found != specs.end() && !found->reads_only && operation != kLogInName && operation != kLogOutName;
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

Outcome RefusedByTrip(std::int32_t status) {
  return Rejected(Reason::REASON_DEVICE_ALARM, "the motor is tripped (" + StatusText(status) +
                                                   "), and does not start then; clear the cause first");
}

std::optional<Outcome> RefusalByState(std::string_view operation, const MotorReading& reading) {
  return operation == kStartMotorName && reading.tripped ? std::optional(RefusedByTrip(reading.status_bits))
                                                         : std::nullopt;
}

}  // namespace axlecast::tsubaki_sc
