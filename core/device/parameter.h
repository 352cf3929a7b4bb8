#pragma once

#include <cstdint>
#include <string_view>

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

}  // namespace axlecast
