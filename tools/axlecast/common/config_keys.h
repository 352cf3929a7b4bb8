#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/config/config_map.h"

namespace axlecast {

// Every key that a file was asked for, a line each: where it stands, what it is, its range, what holds without it.
[[nodiscard]] std::string ConfigKeysText(const std::vector<ConfigKey>& keys);
// The same as a list of objects: place, kind (null: only its presence was asked for), range, default (null: none), required.
[[nodiscard]] nlohmann::ordered_json ConfigKeysJson(const std::vector<ConfigKey>& keys);

}  // namespace axlecast
