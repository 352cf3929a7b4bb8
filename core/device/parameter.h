#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace axlecast {

// One setting that a device keeps. Its value is register x 10^-decimals in `unit`.
struct ParameterSpec {
  std::string_view name;
  std::uint16_t address;  // as the maker counts registers
  std::string_view unit;  // SI
  int decimals;           // of the register's unit: 1 for 0.1 W
  std::int32_t min;       // in register units
  std::int32_t max;       // in register units
  bool zero_disables;     // 0 switches off what it limits
  std::string_view help;
};

// A register's value in the parameter's unit: "125.0".
[[nodiscard]] std::string ParameterText(const ParameterSpec& parameter, std::uint16_t raw);

// Reads "125", "125.0" or "125 W" and returns the value of the register. Fails if the text is not a number, is finer than
// a step of the register, or is out of range.
[[nodiscard]] Result<std::uint16_t> ParseParameter(const ParameterSpec& parameter, std::string_view text);

}  // namespace axlecast
