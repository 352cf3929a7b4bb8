#pragma once

#include <functional>
#include <map>
#include <string>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The machine's devices by name; null where their family is unknown here.
using DeviceFamilies = std::map<std::string, const Family*, std::less<>>;

// Reads `bridge`: who may command which devices, and with which keys.
[[nodiscard]] BridgeConfig LoadBridge(ConfigMap map, const DeviceFamilies& devices);

}  // namespace axlecast
