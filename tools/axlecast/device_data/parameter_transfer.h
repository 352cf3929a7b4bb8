#pragma once

#include <string>
#include <vector>

#include "core/device/family.h"
#include "tools/axlecast/command/command_report.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/operator_client.h"
#include "tools/axlecast/device_data/parameter_diff.h"

namespace axlecast {

// A device's parameters over the bridge. `wish` names the device, validity and reason.

struct ParameterReading {
  ParameterValues values;  // empty when it failed
  CommandResult result;    // of the command
  std::string problem;     // what was wrong besides the command's outcome
};
[[nodiscard]] ParameterReading ReadParameters(OperatorClient& client, const Family& family,
                                              const CommandOptions& wish);

// One command for at most 16 of them; ends with the first that is not verified.
[[nodiscard]] std::vector<CommandResult> WriteParameters(OperatorClient& client, const CommandOptions& wish,
                                                         const ParameterChanges& changes);

// The commands of a write, each as far as an argument list goes.
[[nodiscard]] std::vector<CommandRequest> WriteRequests(const CommandOptions& wish,
                                                        const ParameterChanges& changes);

}  // namespace axlecast
