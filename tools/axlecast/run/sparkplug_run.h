#pragma once

#include "core/config/machine_config.h"

namespace axlecast {

// Publishes the machine to its broker as an edge node of Sparkplug B, until a signal or for `seconds` (0: no limit). Prints a
// summary at the end, with `as_json` as one JSON object on standard output. Returns the exit code.
[[nodiscard]] int RunSparkplug(const MachineConfig& machine, double seconds, bool as_json);

}  // namespace axlecast
