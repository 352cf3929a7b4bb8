#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/device/parameter.h"

namespace axlecast {

// A register's value in the parameter's unit: "125.0".
[[nodiscard]] std::string ParameterText(const ParameterSpec& parameter, std::uint16_t raw);

// "125", "125.0", "125 W": the register's value. `problem` says why there is none: no number, finer than the
// register, out of range.
[[nodiscard]] std::optional<std::uint16_t> ParseParameter(const ParameterSpec& parameter, std::string_view text,
                                                          std::string& problem);

}  // namespace axlecast
