#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/monitor/machine_counts.h"

namespace axlecast {

// Rows of devices, buses, hosts and alarms, with the number of each state; a state that no part has is omitted. The row of the hosts
// is omitted if the machine names none.
[[nodiscard]] std::string CountsText(const MachineCounts& counts);

// The same as an object; every state has its number, also 0 (docs/cli.md, "status").
[[nodiscard]] nlohmann::ordered_json CountsJson(const MachineCounts& counts);

}  // namespace axlecast
