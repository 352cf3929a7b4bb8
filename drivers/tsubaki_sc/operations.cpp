#include "drivers/tsubaki_sc/operations.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "core/device/operation.h"
#include "drivers/kit/arguments.h"
#include "drivers/tsubaki_sc/access.h"
#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/motor.h"
#include "drivers/tsubaki_sc/parameters.h"
#include "drivers/tsubaki_sc/readout.h"
#include "drivers/tsubaki_sc/trips.h"

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
       .verification = "coil 100 reads 1; whether the motor has stopped cannot be read",
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

using Made = Result<std::unique_ptr<Procedure>>;

constexpr std::size_t kMaxNames = 4;    // changes of an outcome
constexpr std::size_t kMaxValues = 16;  // arguments of a command

using Values = std::vector<ParameterValue>;

Made Unknown(std::string_view name) {
  return BadArgument("there is no parameter " + std::string(name.substr(0, 40)) +
                     "; e.g. power_upper_a_1_50hz, start_time_1, log_interval");
}

// name=value pairs as parameters, in the order of their addresses.
Result<Values> ParseValues(const Arguments& arguments) {
  Values values;
  for (const auto& [name, text] : arguments) {
    const ParameterSpec* parameter = FindParameter(name);
    if (parameter == nullptr) return BadArgument("there is no parameter " + name.substr(0, 40));
    const Result<std::uint16_t> value = ParseParameter(*parameter, text);
    if (!value) return BadArgument(value.error().text);
    values.push_back({parameter, *value});
  }
  if (values.empty() || values.size() > kMaxValues) return BadArgument("give 1 to 16 parameters as name=value");
  std::sort(values.begin(), values.end(), [](const ParameterValue& a, const ParameterValue& b) {
    return a.parameter->address < b.parameter->address;
  });
  const auto twice = std::adjacent_find(values.begin(), values.end(),
                                        [](const auto& a, const auto& b) { return a.parameter == b.parameter; });
  if (twice != values.end()) return BadArgument(std::string(twice->parameter->name) + " is given twice");
  return values;
}

// The values that a write_parameter or write_parameters asks for.
Result<Values> WrittenBy(std::string_view operation, const Arguments& arguments) {
  if (operation == kWriteParametersName) return ParseValues(arguments);
  if (operation != kWriteParameterName) return BadArgument("after must be a write_parameter or write_parameters");
  return ParseValues({{std::string(FindArgument(arguments, "name").value_or("")),
                       std::string(FindArgument(arguments, "value").value_or(""))}});
}

Made MakeWrite(const DriverCommand& command, const OperationContext& context) {
  Result<Values> values = WrittenBy(command.operation, command.arguments);
  if (!values) return Failure(values.error());
  return std::make_unique<ParameterWrite>(context.requests, *std::move(values), context.output);
}

Made MakeReadSome(std::string_view names, const OperationContext& context) {
  std::vector<ParameterValue> wanted;
  while (!names.empty()) {
    const std::size_t comma = std::min(names.find(','), names.size());
    const std::string_view name = names.substr(0, comma);
    const ParameterSpec* parameter = FindParameter(name);
    if (parameter == nullptr) return Unknown(name);
    wanted.push_back({parameter, 0});
    names.remove_prefix(std::min(comma + 1, names.size()));
  }
  if (wanted.empty() || wanted.size() > kMaxNames) {
    return BadArgument("names must be one to four, separated by commas; leave it out for all");
  }
  return std::make_unique<ParameterRead>(context.requests, std::move(wanted), false);
}

Made MakeRead(const DriverCommand& command, const OperationContext& context) {
  if (const auto after = FindArgument(command.arguments, "after")) {
    const CommandLine line = ParseCommandLine(*after);
    Result<Values> values = WrittenBy(line.operation, line.arguments);
    if (!values) return Failure(values.error());
    return std::make_unique<ParameterRead>(context.requests, *std::move(values), true);
  }
  const auto names = FindArgument(command.arguments, "names");
  if (!names) return std::make_unique<ParameterRead>(context.requests, std::vector<ParameterValue>(), false);
  return MakeReadSome(*names, context);
}

Made MakeReadState(const DriverCommand& command, const OperationContext& context) {
  std::string after;
  if (const auto text = FindArgument(command.arguments, "after")) {
    after = ParseCommandLine(*text).operation;
    if (after != kStopMotorName && after != kStartMotorName && after != kClearTripCountName) {
      return BadArgument("after must be stop_motor, start_motor or clear_trip_count");
    }
  }
  return std::make_unique<Readout>(context.requests, StateBlocks(), &ShowState,
                                   context.settings.password_format.order, std::move(after));
}

Made MakeMotor(const DriverCommand& command, const OperationContext& context) {
  const MotorControl allowed = context.settings.motor_control;
  if (command.operation == kStopMotorName) {
    if (allowed != MotorControl::kNone) return std::make_unique<MotorStop>(context.requests);
    return NotPermitted("the configuration of this device has no motor_control: stop or start_stop");
  }
  if (allowed == MotorControl::kStartStop) {
    return std::make_unique<CoilCommand>(CoilCommand::Kind::kStartMotor, context.requests);
  }
  return NotPermitted("the configuration of this device has no motor_control: start_stop");
}

Made MakeSetPassword(const DriverCommand& command, const OperationContext& context) {
  const std::string name(FindArgument(command.arguments, "name").value_or(""));
  if (!context.passwords.Has(name)) return BadArgument("name must be a NAME of passwords in the configuration");
  const Result<Secret> secret = context.passwords.Read(name);
  if (!secret) return NotPermitted(secret.error().text);
  const PasswordFormat& format = context.settings.password_format;
  Frame frame = WritePassword(context.requests.address(), kPassword, secret->text(), format);
  auto made =
      std::make_unique<PasswordChange>(context.requests, frame, PasswordComparison(context.passwords, format, name),
                                       context.passwords, context.login, context.output);
  Wipe(frame);
  return made;
}

Made MakeCheckPassword(const DriverCommand& command, const OperationContext& context) {
  std::string name(FindArgument(command.arguments, "name").value_or(""));
  if (const auto after = FindArgument(command.arguments, "after")) {
    const CommandLine line = ParseCommandLine(*after);
    if (line.operation != kSetPasswordName) return BadArgument("after must be a set_password");
    name = FindArgument(line.arguments, "name").value_or("");
  }
  if (!context.passwords.Has(name)) return BadArgument("name must be a NAME of passwords in the configuration");
  return std::make_unique<PasswordCheck>(
      context.requests, PasswordComparison(context.passwords, context.settings.password_format, std::move(name)),
      context.passwords);
}

Made MakeLogIn(const OperationContext& context, LoginGoal goal) {
  if (context.passwords.active().empty()) {
    return NotPermitted("the configuration names no password to log in or out with");
  }
  if (goal == LoginGoal::kOut && context.settings.StaysLoggedIn()) {
    return NotPermitted(
        "motor_control keeps the unit logged in, so that a stop needs no login first: set log_out: true");
  }
  return std::make_unique<LogIn>(context.requests, goal);
}

Made MakeReadout(const OperationContext& context, std::vector<Block> blocks, Readout::Show show) {
  return std::make_unique<Readout>(context.requests, std::move(blocks), show,
                                   context.settings.password_format.order, "");
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

Result<> CheckNotTripped(std::int32_t status) {
  if ((status & kTripBits) == 0) return {};
  return Failure(
      "the motor is tripped (" + StatusText(status) + "), and does not start then; clear the cause first",
      Reason::REASON_DEVICE_ALARM);
}

Made MakeProcedure(const DriverCommand& command, const OperationContext& context) {
  const std::string_view name = command.operation;
  if (name == kStopMotorName || name == kStartMotorName) return MakeMotor(command, context);
  const bool password = NeedsLogin(name) || name == kCheckPasswordName;
  if (password && context.passwords.active().empty()) {
    return NotPermitted("the configuration names no password: add passwords and password");
  }
  if (name == kClearTripCountName) {
    return std::make_unique<CoilCommand>(CoilCommand::Kind::kClearTripCount, context.requests);
  }
  if (name == kReadStateName) return MakeReadState(command, context);
  if (name == kReadSetValuesName) return MakeReadout(context, {kSetValues}, &ShowSetValues);
  if (name == kReadIdentityName) return MakeReadout(context, IdentityBlocks(), &ShowIdentity);
  if (name == kReadParameterName)
    return MakeReadSome(FindArgument(command.arguments, "name").value_or(""), context);
  if (name == kReadParametersName) return MakeRead(command, context);
  if (name == kWriteParameterName || name == kWriteParametersName) return MakeWrite(command, context);
  if (name == kFetchTripLogsName) return std::make_unique<TripFetch>(context.requests, context.trips);
  if (name == kLogInName) return MakeLogIn(context, LoginGoal::kIn);
  if (name == kLogOutName) return MakeLogIn(context, LoginGoal::kOut);
  if (name == kSetPasswordName) return MakeSetPassword(command, context);
  if (name == kCheckPasswordName) return MakeCheckPassword(command, context);
  return UnknownOperation("tsubaki_sc", command.operation);
}

}  // namespace axlecast::tsubaki_sc
