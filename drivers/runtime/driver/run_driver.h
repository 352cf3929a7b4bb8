#pragma once

#include "drivers/runtime/config/machine_config.h"

namespace axlecast {

// Runs the driver of one bus until SIGTERM or SIGINT. Returns the process's exit code: 0 after a clean stop, 1 when
// LCM cannot be used (any more). A missing port is a state, not an exit.
[[nodiscard]] int RunDriver(const MachineConfig& machine, const BusConfig& bus, bool verbose);

}  // namespace axlecast
