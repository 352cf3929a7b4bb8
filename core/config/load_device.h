#pragma once

#include <string>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// One entry of a bus's `devices`: the keys that every encoder has, then the family's own. `bus` holds what its own
// keys say.
[[nodiscard]] DeviceConfig LoadDevice(const std::string& name, ConfigMap& map, const BusConfig& bus);

}  // namespace axlecast
