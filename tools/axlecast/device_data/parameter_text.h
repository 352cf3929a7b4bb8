#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/axlecast/command/command_report.h"
#include "tools/axlecast/device_data/parameter_diff.h"
#include "tools/axlecast/device_data/parameter_values.h"

namespace axlecast {

// What the `param` verbs print.

// Names, present values, ranges, meanings. `values`: those that the device holds; of the others "-" and null.
[[nodiscard]] std::string ListText(Parameters parameters, const ParameterValues& values);
[[nodiscard]] nlohmann::ordered_json ListJson(Parameters parameters, const ParameterValues& values);

// Only those of these names, in their order; all when there are none.
[[nodiscard]] ParameterValues Chosen(const ParameterValues& values, const std::vector<std::string>& names);
[[nodiscard]] std::string ToText(const ParameterValues& values);
[[nodiscard]] nlohmann::ordered_json ToJson(const std::string& device, const ParameterValues& values);

// How a write ended: `results` are those of its commands, in their order.
[[nodiscard]] std::string WriteText(const std::string& device, const ParameterChanges& changes,
                                    const std::vector<CommandResult>& results);
[[nodiscard]] nlohmann::ordered_json WriteJson(const std::string& device, const ParameterChanges& changes,
                                               const std::vector<CommandResult>& results);

}  // namespace axlecast
