#pragma once

#include <string>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The key of `link` that names the line: port, iface or spidev.
[[nodiscard]] const char* LinkKey(LinkKind kind);

// Reads `link` as the family's kind of line has it; errors go into the map's list. A simulated bus has its pty or
// socket at `place` with a suffix of its kind.
[[nodiscard]] LinkConfig LoadLink(ConfigMap map, const Family& family, bool simulate, const std::string& place);

}  // namespace axlecast
