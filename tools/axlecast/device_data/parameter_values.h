#pragma once

#include <axlecast/change_t.hpp>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/parameter.h"

namespace axlecast {

using Parameters = std::span<const ParameterSpec>;  // those that a family has

struct ParameterValue {
  const ParameterSpec* parameter;
  std::uint16_t raw;  // as its register holds it
};
using ParameterValues = std::vector<ParameterValue>;  // in the family's order

// Null when there is none of that name.
[[nodiscard]] const ParameterSpec* FindParameter(Parameters parameters, std::string_view name);
[[nodiscard]] std::string UnknownParameter(Parameters parameters, std::string_view name);  // with the nearest

// What `read_parameters` answers: changes "registers FIRST-LAST", 4 hex digits a register. `problem` says what is
// malformed, or which parameter is missing.
[[nodiscard]] ParameterValues FromRegisters(Parameters parameters, std::span<const change_t> changes,
                                            std::string& problem);

// NAME=VALUE words as a person typed them.
[[nodiscard]] ParameterValues FromWords(Parameters parameters, std::span<const std::string> words,
                                        std::string& problem);

// "125.0 W"; what is switched off by its 0 says so.
[[nodiscard]] std::string ValueText(const ParameterValue& value);
// "0.0 to 1000.0 W, 0 switches it off"
[[nodiscard]] std::string RangeText(const ParameterSpec& parameter);

}  // namespace axlecast
