#pragma once

#include "drivers/runtime/config/config_map.h"
#include "drivers/runtime/config/web_config.h"

namespace axlecast {

// The `web` block.
[[nodiscard]] WebConfig LoadWeb(ConfigMap map);

}  // namespace axlecast
