#pragma once

#include <string>
#include <vector>

#include "client/axlecast/command.h"
#include "core/config/machine_config.h"
#include "core/device/operation.h"

namespace axlecast {

// The operations of the devices of a bus: its family's, then those that the runtime gives every encoder.
[[nodiscard]] std::vector<const OperationSpec*> OperationsOf(const BusConfig& bus);

// An operation that was found, or why not.
struct FoundOperation {
  const BusConfig* bus = nullptr;
  const OperationSpec* operation = nullptr;
  std::string problem;  // names what is valid; empty when found
};
[[nodiscard]] FoundOperation FindOperation(const MachineConfig& machine, const std::string& device,
                                           const std::string& operation);

// "key=value" words into `request.arguments`; an empty string, or what is wrong: a word without '=', a key that the
// operation does not take, one given twice, a required one that is missing.
[[nodiscard]] std::string SetArguments(const OperationSpec& operation, const std::vector<std::string>& words,
                                       CommandRequest& request);

// The operations with their arguments and what they do, for `do DEVICE --list`.
[[nodiscard]] std::string OperationList(const BusConfig& bus);

}  // namespace axlecast
