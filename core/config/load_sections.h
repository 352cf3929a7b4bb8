#pragma once

#include <functional>
#include <map>
#include <string>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The key of `link` that names the line: port, iface or spidev.
[[nodiscard]] const char* LinkKey(LinkKind kind);

// Reads `link` as the family's kind of line has it; errors go into the map's list. A simulated bus has its pty or
// socket at `place` with a suffix of its kind.
[[nodiscard]] LinkConfig LoadLink(ConfigMap map, const Family& family, bool simulate, const std::string& place);

// One entry of a bus's `devices`: the keys that every encoder has, then the family's own. `bus` holds what its own
// keys say.
[[nodiscard]] DeviceConfig LoadDevice(const std::string& name, ConfigMap& map, const BusConfig& bus);

// The machine's devices by name; null where their family is unknown here.
using DeviceFamilies = std::map<std::string, const Family*, std::less<>>;

// Reads `bridge`: who may command which devices, and with which keys.
[[nodiscard]] BridgeConfig LoadBridge(ConfigMap map, const DeviceFamilies& devices);

}  // namespace axlecast
