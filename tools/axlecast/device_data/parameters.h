#pragma once

#include <axlecast/change_t.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/config/config_map.h"
#include "core/device/family.h"
#include "core/device/parameter.h"
#include "tools/axlecast/command/command_run.h"

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

// What the `param` verbs print.

// Names, present values, ranges, meanings. `values`: those that the device holds; of the others "-" and null.
[[nodiscard]] std::string ListText(Parameters parameters, const ParameterValues& values);
[[nodiscard]] nlohmann::ordered_json ListJson(Parameters parameters, const ParameterValues& values);

// Only those of these names, in their order; all when there are none.
[[nodiscard]] ParameterValues Chosen(const ParameterValues& values, const std::vector<std::string>& names);
[[nodiscard]] std::string ToText(const ParameterValues& values);
[[nodiscard]] nlohmann::ordered_json ToJson(const std::string& device, const ParameterValues& values);

// How a write ended: `results` are those of its commands, in their order.
[[nodiscard]] std::string WriteText(const std::string& device, const ParameterChanges& changes,
                                    const std::vector<CommandResult>& results);
[[nodiscard]] nlohmann::ordered_json WriteJson(const std::string& device, const ParameterChanges& changes,
                                               const std::vector<CommandResult>& results);

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
