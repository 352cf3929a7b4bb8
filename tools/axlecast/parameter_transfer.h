#pragma once

#include <string>
#include <vector>

#include "drivers/runtime/config/machine_config.h"
#include "tools/axlecast/command_report.h"
#include "tools/axlecast/command_run.h"
#include "tools/axlecast/parameter_diff.h"

namespace axlecast {

// A device's parameters over the bridge. `wish` names the device, validity and reason.

struct ParameterReading {
  ParameterValues values;  // empty when it failed
  CommandResult result;    // of the command
  std::string problem;     // what was wrong besides the command's outcome
};
[[nodiscard]] ParameterReading ReadParameters(const MachineConfig& machine, const CommandWish& wish);

// One command for at most 16 of them; ends with the first that is not verified.
[[nodiscard]] std::vector<CommandResult> WriteParameters(const MachineConfig& machine, const CommandWish& wish,
                                                         const ParameterChanges& changes);

// The commands of a write, each as far as an argument list goes.
[[nodiscard]] std::vector<CommandRequest> WriteRequests(const CommandWish& wish, const ParameterChanges& changes);

}  // namespace axlecast
