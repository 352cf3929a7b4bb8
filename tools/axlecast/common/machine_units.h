#pragma once

#include <string>
#include <vector>

#include "core/config/machine_config.h"

namespace axlecast {

// The systemd units that `machine` consists of, by its file: a driver for each bus, the bridge, the recorder where logs
// are named, the simulators where a bus has them.
[[nodiscard]] std::vector<std::string> MachineUnits(const MachineConfig& machine);

// The names of its buses, or of its devices, in the file's order.
[[nodiscard]] std::vector<std::string> MachineNames(const MachineConfig& machine, bool devices);

}  // namespace axlecast
