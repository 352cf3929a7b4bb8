#include "tools/axlecast/command/command_request.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>

#include "core/base/spelling.h"
#include "core/command/commands.h"
#include "tools/axlecast/live/format_device.h"

namespace axlecast {
namespace {

std::string KnownArguments(const OperationSpec& operation) {
  std::vector<std::string> names;
  for (const ArgumentSpec& argument : operation.arguments) names.emplace_back(argument.name);
  return names.empty() ? "it takes no arguments" : "arguments: " + Listed(names);
}

bool Takes(const OperationSpec& operation, const std::string& key) {
  return std::any_of(operation.arguments.begin(), operation.arguments.end(),
                     [&key](const ArgumentSpec& argument) { return argument.name == key; });
}

bool Holds(const CommandRequest& request, std::string_view key) {
  return std::any_of(request.arguments.begin(), request.arguments.end(),
                     [key](const auto& argument) { return argument.first == key; });
}

bool Has(const Family& family, std::string_view operation) {
  return std::any_of(family.operations.begin(), family.operations.end(),
                     [operation](const OperationSpec& known) { return known.name == operation; });
}

std::string DevicesWith(const MachineConfig& machine, std::string_view operation) {
  std::vector<std::string> names;
  for (const BusConfig& bus : machine.buses) {
    if (!Has(*bus.family, operation)) continue;
    for (const DeviceConfig& device : bus.devices) names.push_back(device.name);
  }
  return names.empty() ? "no device of this machine has it"
                       : "devices of this machine that have it: " + Listed(names);
}

bool HasZero(const Family& family) {
  return std::any_of(family.operations.begin(), family.operations.end(),
                     [](const OperationSpec& known) { return known.name.starts_with("zero"); });
}

bool IsOfSomeFamily(const std::string& operation) {
  return std::any_of(Families().begin(), Families().end(),
                     [&operation](const Family* family) { return Has(*family, operation); });
}

// Returns a hint that helps more than a list of operations, or an empty text. A device without zero needs a software
// datum. An operation of other families belongs to other devices.
std::string Hint(const MachineConfig& machine, const BusConfig& bus, const std::string& device,
                 const std::string& operation) {
  const Family& family = *bus.family;
  if (operation.starts_with("zero") && family.has_position && !HasZero(family)) {
    return ": encoders of " + std::string(family.name) + " keep no zero. Set one in software: axlecast home " +
           device + " --value 0";
  }
  if (!IsOfSomeFamily(operation)) return "";
  return std::string(family.has_position ? ": it is an encoder (" : ": it is a monitor of motors (") +
         std::string(family.name) + "); " + DevicesWith(machine, operation);
}

}  // namespace

void AddCommandOptions(CLI::App& command, ConfigOption& config, CommandOptions& options, bool asks) {
  config.AddTo(command, ConfigOption::Form::kOptionOnly);
  AddKeyOption(command, options.key);
  if (asks) command.add_flag("--yes", options.yes, "Do not ask");
  command.add_flag("--json", options.json, "Print the outcome as one JSON object");
  command
      .add_option("--valid-ms", options.valid_ms, "Maximum time until the command begins, in ms; then it expires")
      ->check(CLI::Range(1, 3'600'000))
      ->type_name("MS")
      ->capture_default_str();
  command.add_option("--epoch", options.epoch, "Reject the command if the device's datum_epoch differs")
      ->check(CLI::Range(0, INT32_MAX))
      ->type_name("N");
  AddReasonOption(command, options.reason);
}

void AddReasonOption(CLI::App& command, std::string& reason) {
  command.add_option("--reason", reason, "Reason for the journal; at most 160 bytes")
      ->check(CLI::Validator([](const std::string& text) { return text.size() <= 160 ? "" : "above 160 bytes"; },
                             "TEXT"));
}

void AddKeyOption(CLI::App& command, std::string& key) {
  command
      .add_option(
          "--key", key,
          "File of the secret key that signs; default $AXLECAST_KEY, else the first readable key of the machine's "
          "file")
      ->type_name("FILE");
}

CLI::Validator PlainNumber() {
  return CLI::Validator(
      [](const std::string& text) -> std::string {
        if (CLI::Number(text).empty()) return "";
        const std::size_t digits = text.find_first_not_of("+-.0123456789");
        const std::string number = text.substr(0, digits);
        if (digits == 0 || !CLI::Number(number).empty()) return Quoted(text) + " is no number, e.g. 123.456";
        return Quoted(text) +
               " is no number: leave the unit out (it is the device's, see `axlecast info DEVICE`), " +
               "and write " + number;
      },
      "NUMBER");
}

void AddTwoStepOptions(CLI::App& command, CommandOptions& options) {
  CLI::Option* prepare = command.add_flag("--prepare", options.prepare,
                                          "Only report what would happen, and print a token for --commit");
  command
      .add_option("--commit", options.commit,
                  "Execute the command that --prepare with the same words printed this token for; does not ask")
      ->check(CLI::Validator(
          [](const std::string& text) { return ParseId(text) ? "" : "a token is 32 hex digits"; }, "TOKEN"))
      ->excludes(prepare);
}

std::vector<const OperationSpec*> OperationsOf(const BusConfig& bus) {
  std::vector<const OperationSpec*> operations;
  for (const OperationSpec& operation : bus.family->operations) operations.push_back(&operation);
  for (const OperationSpec& operation : RuntimeOperations(*bus.family)) {
    if (!operation.internal) operations.push_back(&operation);
  }
  return operations;
}

Result<FoundOperation> FindOperation(const MachineConfig& machine, const std::string& device,
                                     const std::string& operation) {
  const BusConfig* bus = machine.BusOf(device);
  if (bus == nullptr) return Failure(UnknownDevice(machine, device));
  std::vector<std::string> names;
  for (const OperationSpec* candidate : OperationsOf(*bus)) {
    if (candidate->name == operation) return FoundOperation{bus, candidate};
    names.emplace_back(candidate->name);
  }
  const std::string text = device + " has no operation " + Quoted(operation);
  if (const std::string hint = Hint(machine, *bus, device, operation); !hint.empty()) {
    return Failure(text + hint);
  }
  const std::optional<std::string> nearest = NearestWord(operation, names);
  return Failure(text + (nearest ? "; did you mean " + *nearest + '?' : "") + "\noperations: " + Listed(names));
}

Result<> SetArguments(const OperationSpec& operation, const std::vector<std::string>& words,
                      CommandRequest& request) {
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0) return Failure(Quoted(word) + " is no key=value");
    const std::string key = word.substr(0, equals);
    if (!Takes(operation, key)) {
      return Failure(std::string(operation.name) + " takes no " + Quoted(key) + "; " + KnownArguments(operation));
    }
    if (Holds(request, key)) return Failure(Quoted(key) + " is given twice");
    request.arguments.emplace_back(key, word.substr(equals + 1));
  }
  for (const ArgumentSpec& argument : operation.arguments) {
    if (argument.required && !Holds(request, argument.name)) {
      return Failure(std::string(operation.name) + " needs " + std::string(argument.name) + "=... (" +
                     std::string(argument.help) + ")");
    }
  }
  return {};
}

std::string OperationList(const BusConfig& bus) {
  std::string text;
  for (const OperationSpec* operation : OperationsOf(bus)) {
    text += std::string(operation->name) + (operation->destructive ? "  (destructive: asks first)" : "") +
            "\n    " + std::string(operation->help) + '\n';
    for (const ArgumentSpec& argument : operation->arguments) {
      text += "    " + std::string(argument.name) + "=  " + std::string(argument.help) +
              (argument.required ? "" : " (optional)") + '\n';
    }
    if (!operation->verification.empty()) text += "    verified by: " + std::string(operation->verification) + '\n';
  }
  return text;
}

}  // namespace axlecast
