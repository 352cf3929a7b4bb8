#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

#include "core/config/config_map.h"

namespace axlecast {

// The one document of a YAML text. Reports what yaml-cpp would pass over in silence: a key that stands twice, a key
// that is no plain text, a second document, a text larger or nested deeper than any machine's. The node is
// undefined when there is nothing to go on with.
[[nodiscard]] YAML::Node ParseYaml(const std::string& text, ConfigErrors& errors);

}  // namespace axlecast
