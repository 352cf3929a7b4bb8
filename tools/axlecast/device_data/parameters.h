#pragma once

#include <axlecast/change_t.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/config/config_map.h"
#include "core/device/family.h"
#include "core/device/parameter.h"
#include "tools/axlecast/command/command_run.h"

namespace axlecast {

// The parameters of a device: values, differences, texts and their file. Pure.

using Parameters = std::span<const ParameterSpec>;  // of a family

struct ParameterValue {
  const ParameterSpec* parameter;
  std::uint16_t raw;  // value of its register
};
using ParameterValues = std::vector<ParameterValue>;  // in the order of the family

// Returns null if the name is unknown.
[[nodiscard]] const ParameterSpec* FindParameter(Parameters parameters, std::string_view name);
// Returns the error for an unknown parameter, with the nearest name.
[[nodiscard]] std::string UnknownParameter(Parameters parameters, std::string_view name);

// Parses the changes of `read_parameters`: "registers FIRST-LAST" with 4 hex digits per register. Fails if a change is
// malformed or a parameter is missing.
[[nodiscard]] Result<ParameterValues> FromRegisters(Parameters parameters, std::span<const change_t> changes);

// Parses NAME=VALUE words. Fails if a word is malformed, or its name unknown or repeated.
[[nodiscard]] Result<ParameterValues> FromWords(Parameters parameters, std::span<const std::string> words);

// "125.0 W", or "0.0 W (off)" if 0 switches it off
[[nodiscard]] std::string ValueText(const ParameterValue& value);
// "0.0 to 1000.0 W, 0 switches it off"
[[nodiscard]] std::string RangeText(const ParameterSpec& parameter);

struct ParameterChange {
  const ParameterSpec* parameter;
  std::uint16_t before;
  std::uint16_t after;
};
using ParameterChanges = std::vector<ParameterChange>;

// Returns the values of `wanted` that differ in `present`, in the order of `wanted`. `present` must contain all of them.
[[nodiscard]] ParameterChanges ParameterDiff(const ParameterValues& present, const ParameterValues& wanted);

// Formats one line per change: "power_upper_a_1_50hz  100.0 -> 125.0 W".
[[nodiscard]] std::string ToText(const ParameterChanges& changes);

// Returns a list of objects: name, unit, before, after.
[[nodiscard]] nlohmann::ordered_json ToJson(const ParameterChanges& changes);

// Returns the value of the register in the parameter's unit.
[[nodiscard]] double NumberOf(const ParameterSpec& parameter, std::uint16_t raw);

// Format the names, present values, ranges and meanings. A parameter without a value has "-" and null.
[[nodiscard]] std::string ListText(Parameters parameters, const ParameterValues& values);
[[nodiscard]] nlohmann::ordered_json ListJson(Parameters parameters, const ParameterValues& values);

// Returns the values with these names, in their order, or all values if `names` is empty.
[[nodiscard]] ParameterValues Chosen(const ParameterValues& values, const std::vector<std::string>& names);
[[nodiscard]] std::string ToText(const ParameterValues& values);
[[nodiscard]] nlohmann::ordered_json ToJson(const std::string& device, const ParameterValues& values);

// Format the outcome of a write. `results` are the results of its commands, in their order.
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

// Parses the values of a file, which may omit parameters. Adds all errors, each with its line and a correction.
[[nodiscard]] ParameterValues ParseParameterFile(const Family& family, const std::string& text,
                                                 ConfigErrors& errors);

}  // namespace axlecast
