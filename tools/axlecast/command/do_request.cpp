#include "tools/axlecast/command/do_request.h"

#include <algorithm>
#include <optional>

#include "core/base/spelling.h"
#include "core/command/operation_check.h"
#include "tools/axlecast/live/status_text.h"

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

bool Has(const BusConfig& bus, std::string_view operation) {
  return std::any_of(bus.family->operations.begin(), bus.family->operations.end(),
                     [operation](const OperationSpec& known) { return known.name == operation; });
}

// The machine's devices that have an operation.
std::string WhoHas(const MachineConfig& machine, std::string_view operation) {
  std::vector<std::string> names;
  for (const BusConfig& bus : machine.buses) {
    if (!Has(bus, operation)) continue;
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
  return std::any_of(Families().begin(), Families().end(), [&operation](const Family* family) {
    return std::any_of(family->operations.begin(), family->operations.end(),
                       [&operation](const OperationSpec& known) { return known.name == operation; });
  });
}

// What leads further than a list of operations: for a zero that only software can give, and for an operation of other
// devices. Empty: nothing.
std::string BetterWay(const MachineConfig& machine, const BusConfig& bus, const std::string& device,
                      const std::string& operation) {
  const Family& family = *bus.family;
  if (operation.starts_with("zero") && family.has_position && !HasZero(family)) {
    return ": encoders of " + std::string(family.name) + " keep no zero. Set one in software: axlecast home " +
           device + " --value 0";
  }
  if (!IsOfSomeFamily(operation)) return "";
  return std::string(family.has_position ? ": it is an encoder (" : ": it is a monitor of motors (") +
         std::string(family.name) + "); " + WhoHas(machine, operation);
}

}  // namespace

std::vector<const OperationSpec*> OperationsOf(const BusConfig& bus) {
  std::vector<const OperationSpec*> operations;
  for (const OperationSpec& operation : bus.family->operations) operations.push_back(&operation);
  for (const OperationSpec& operation : RuntimeOperations(*bus.family)) {
    if (!operation.internal) operations.push_back(&operation);
  }
  return operations;
}

FoundOperation FindOperation(const MachineConfig& machine, const std::string& device,
                             const std::string& operation) {
  FoundOperation found;
  found.bus = machine.BusOf(device);
  if (found.bus == nullptr) {
    found.problem = UnknownDevice(machine, device);
    return found;
  }
  std::vector<std::string> names;
  for (const OperationSpec* candidate : OperationsOf(*found.bus)) {
    if (candidate->name == operation) found.operation = candidate;
    names.emplace_back(candidate->name);
  }
  if (found.operation != nullptr) return found;
  if (std::string better = BetterWay(machine, *found.bus, device, operation); !better.empty()) {
    found.problem = device + " has no operation " + Quoted(operation) + better;
    return found;
  }
  const std::optional<std::string> nearest = NearestWord(operation, names);
  found.problem = device + " has no operation " + Quoted(operation) +
                  (nearest ? "; did you mean " + *nearest + '?' : "") + "\noperations: " + Listed(names);
  return found;
}

std::string SetArguments(const OperationSpec& operation, const std::vector<std::string>& words,
                         CommandRequest& request) {
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0) return Quoted(word) + " is no key=value";
    const std::string key = word.substr(0, equals);
    if (!Takes(operation, key)) {
      return std::string(operation.name) + " takes no " + Quoted(key) + "; " + KnownArguments(operation);
    }
    if (Holds(request, key)) return Quoted(key) + " is given twice";
    request.arguments.emplace_back(key, word.substr(equals + 1));
  }
  for (const ArgumentSpec& argument : operation.arguments) {
    if (argument.required && !Holds(request, argument.name)) {
      return std::string(operation.name) + " needs " + std::string(argument.name) + "=... (" +
             std::string(argument.help) + ")";
    }
  }
  return "";
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
