#pragma once

#include "drivers/runtime/config/config_map.h"
#include "drivers/runtime/core/secret.h"

namespace axlecast {

// The keys `file` and `credential` of a mapping: at most one of them, or an error. `example`: an absolute path, for
// the message.
[[nodiscard]] SecretPlace LoadPlace(ConfigMap& map, const std::string& example);

}  // namespace axlecast
