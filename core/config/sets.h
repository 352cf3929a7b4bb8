#pragma once

#include <vector>

#include "core/base/result.h"
#include "core/config/machine_config.h"

namespace axlecast {

class ConfigMap;

// Reads `sets` of the machine file's top level: axes whose readings on one tick are published together. The buses, the hosts and the
// time base of `machine` are known.
[[nodiscard]] std::vector<SetConfig> LoadSets(ConfigMap& root, const MachineConfig& machine);

// Returns a set of these axes, with a limit of 0 and the period of their POSITION messages. Fails if they have no common ticks: the
// error names the axis and what to change.
[[nodiscard]] Result<SetConfig> MakeSet(const MachineConfig& machine, const std::vector<std::string>& axes);

}  // namespace axlecast
