#pragma once

#include <string>

#include "core/config/config_map.h"
#include "core/device/family.h"
#include "tools/axlecast/device_data/parameter_values.h"

namespace axlecast {

// The YAML file of `param export` and `param import`:
//
//   family: FAMILY
//   device: gm3
//   parameters:
//     power_upper_a_1_50hz: 125.0  # 0.0 to 1000.0 W, 0 switches it off

[[nodiscard]] std::string ParameterFileText(const Family& family, const std::string& device,
                                            const ParameterValues& values);

// The values of a file; those of the family that it leaves out stay out. All errors in one go, each with its line and
// what would be right.
[[nodiscard]] ParameterValues ParseParameterFile(const Family& family, const std::string& text,
                                                 ConfigErrors& errors);

}  // namespace axlecast
