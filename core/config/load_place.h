#pragma once

#include "core/base/secret.h"
#include "core/config/config_map.h"

namespace axlecast {

// The keys `file` and `credential` of a mapping: at most one of them, or an error. `example`: an absolute path, for
// the message.
[[nodiscard]] SecretPlace LoadPlace(ConfigMap& map, const std::string& example);

}  // namespace axlecast
