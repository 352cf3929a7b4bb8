#pragma once

#include "core/config/config_map.h"
#include "core/config/web_config.h"

namespace axlecast {

// The `web` block.
[[nodiscard]] WebConfig LoadWeb(ConfigMap map);

}  // namespace axlecast
