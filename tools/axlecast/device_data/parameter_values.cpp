#include "tools/axlecast/device_data/parameter_values.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>

#include "core/base/spelling.h"
#include "core/device/parameter.h"

namespace axlecast {
namespace {

using Registers = std::map<std::uint16_t, std::uint16_t>;

template <int kBase>
std::optional<std::uint16_t> Number(std::string_view text) {
  std::uint16_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, kBase);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// False when the change is no "registers FIRST-LAST" with 4 hex digits for each.
bool AddRegisters(const change_t& change, Registers& registers) {
  constexpr std::string_view kKey = "registers ";
  constexpr std::size_t kDigits = 4;
  std::string_view key = change.key;
  if (!key.starts_with(kKey)) return false;
  key.remove_prefix(kKey.size());
  const std::size_t dash = std::min(key.find('-'), key.size() - 1);
  const auto first = Number<10>(key.substr(0, dash));
  const auto last = Number<10>(key.substr(dash + 1));
  if (!first || !last || *last < *first) return false;
  const std::size_t count = std::size_t{*last} - *first + 1;
  if (change.after.size() != kDigits * count) return false;
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = Number<16>(std::string_view(change.after).substr(kDigits * i, kDigits));
    if (!value) return false;
    registers[static_cast<std::uint16_t>(*first + i)] = *value;
  }
  return true;
}

}  // namespace

const ParameterSpec* FindParameter(Parameters parameters, std::string_view name) {
  const auto found = std::find_if(parameters.begin(), parameters.end(),
                                  [name](const ParameterSpec& parameter) { return parameter.name == name; });
  return found == parameters.end() ? nullptr : &*found;
}

std::string UnknownParameter(Parameters parameters, std::string_view name) {
  std::vector<std::string> names;
  for (const ParameterSpec& parameter : parameters) names.emplace_back(parameter.name);
  const std::optional<std::string> near = NearestWord(name, names);
  return "no parameter " + Quoted(name) +
         (near ? "; did you mean " + Quoted(*near) + "?" : "; axlecast param list DEVICE shows them");
}

ParameterValues FromRegisters(Parameters parameters, std::span<const change_t> changes, std::string& problem) {
  Registers registers;
  for (const change_t& change : changes) {
    if (AddRegisters(change, registers)) continue;
    problem = "the device's driver answered " + Quoted(change.key) + " " + Quoted(change.after) +
              ", which are no registers: are driver and axlecast of the same version?";
    return {};
  }
  ParameterValues values;
  for (const ParameterSpec& parameter : parameters) {
    const auto found = registers.find(parameter.address);
    if (found == registers.end()) {
      problem = "the device's driver did not tell " + std::string(parameter.name) +
                ": are driver and axlecast of the same version?";
      return {};
    }
    values.push_back({&parameter, found->second});
  }
  return values;
}

ParameterValues FromWords(Parameters parameters, std::span<const std::string> words, std::string& problem) {
  std::map<const ParameterSpec*, std::uint16_t> wanted;  // by address: the family's order
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    if (equals == std::string::npos || equals == 0) {
      const bool known = FindParameter(parameters, name) != nullptr;
      problem = Quoted(word) + " is no NAME=VALUE: write " + (known ? name : "NAME") +
                "=VALUE, with the = and without blanks";
      return {};
    }
    const ParameterSpec* parameter = FindParameter(parameters, name);
    if (parameter == nullptr) {
      problem = UnknownParameter(parameters, name);
      return {};
    }
    const auto raw = ParseParameter(*parameter, std::string_view(word).substr(equals + 1), problem);
    if (!raw) return {};
    if (!wanted.emplace(parameter, *raw).second) {
      problem = Quoted(name) + " is given twice";
      return {};
    }
  }
  ParameterValues values;
  for (const auto& [parameter, raw] : wanted) values.push_back({parameter, raw});
  return values;
}

std::string ValueText(const ParameterValue& value) {
  const std::string text = ParameterText(*value.parameter, value.raw) + " " + std::string(value.parameter->unit);
  return value.raw == 0 && value.parameter->zero_disables ? text + " (off)" : text;
}

std::string RangeText(const ParameterSpec& parameter) {
  return ParameterText(parameter, static_cast<std::uint16_t>(parameter.min)) + " to " +
         ParameterText(parameter, static_cast<std::uint16_t>(parameter.max)) + " " + std::string(parameter.unit) +
         (parameter.zero_disables ? ", 0 switches it off" : "");
}

}  // namespace axlecast
