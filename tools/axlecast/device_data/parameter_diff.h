#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/axlecast/device_data/parameter_values.h"

namespace axlecast {

// A parameter that is to get another value.
struct ParameterChange {
  const ParameterSpec* parameter;
  std::uint16_t before;
  std::uint16_t after;
};
using ParameterChanges = std::vector<ParameterChange>;

// Those of `wanted` that differ from `present`, in the order of `wanted`; `present` holds all of them.
[[nodiscard]] ParameterChanges ParameterDiff(const ParameterValues& present, const ParameterValues& wanted);

// One line each: "power_upper_a_1_50hz  100.0 -> 125.0 W".
[[nodiscard]] std::string ToText(const ParameterChanges& changes);

// A list of objects: name, unit, before, after.
[[nodiscard]] nlohmann::ordered_json ToJson(const ParameterChanges& changes);

// The register's value in the parameter's unit.
[[nodiscard]] double NumberOf(const ParameterSpec& parameter, std::uint16_t raw);

}  // namespace axlecast
