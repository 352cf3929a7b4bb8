#include "tools/axlecast/device_data/parameters.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/config/yaml_text.h"
#include "tools/axlecast/common/terminal.h"

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

// Returns false if the change is not "registers FIRST-LAST" with 4 hex digits per register.
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

using Json = nlohmann::ordered_json;

constexpr std::size_t kValueWidth = 12;  // "1000.0 W"

// Returns the maximum length of the names of ParameterValues or ParameterChanges.
template <typename Entries>
std::size_t NameWidth(const Entries& entries) {
  std::size_t width = 0;
  for (const auto& entry : entries) width = std::max(width, entry.parameter->name.size());
  return width;
}

Json SpecJson(const ParameterSpec& parameter) {
  return {{"name", parameter.name},
          {"unit", parameter.unit},
          {"min", NumberOf(parameter, static_cast<std::uint16_t>(parameter.min))},
          {"max", NumberOf(parameter, static_cast<std::uint16_t>(parameter.max))},
          {"step", NumberOf(parameter, 1)},
          {"zero_disables", parameter.zero_disables},
          {"help", parameter.help}};
}

// Returns null if the device's value is unknown.
const ParameterValue* ValueOf(const ParameterSpec& parameter, const ParameterValues& values) {
  const auto found = std::find_if(values.begin(), values.end(), [&parameter](const ParameterValue& value) {
    return value.parameter->name == parameter.name;
  });
  return found == values.end() ? nullptr : &*found;
}

bool AllVerified(const std::vector<CommandResult>& results) {
  return results.empty() || ExitCode(results.back()) == kExitDone;
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

Result<ParameterValues> FromRegisters(Parameters parameters, std::span<const change_t> changes) {
  Registers registers;
  for (const change_t& change : changes) {
    if (AddRegisters(change, registers)) continue;
    return Failure("the device's driver answered " + Quoted(change.key) + " " + Quoted(change.after) +
                   ", which are no registers: are driver and axlecast of the same version?");
  }
  ParameterValues values;
  for (const ParameterSpec& parameter : parameters) {
    const auto found = registers.find(parameter.address);
    if (found == registers.end()) {
      return Failure("the device's driver did not report " + std::string(parameter.name) +
                     ": are driver and axlecast of the same version?");
    }
    values.push_back({&parameter, found->second});
  }
  return values;
}

Result<ParameterValues> FromWords(Parameters parameters, std::span<const std::string> words) {
  std::map<const ParameterSpec*, std::uint16_t> wanted;  // by address: the family's order
  for (const std::string& word : words) {
    const std::size_t equals = word.find('=');
    const std::string name = word.substr(0, equals);
    const ParameterSpec* parameter = FindParameter(parameters, name);
    if (equals == std::string::npos || equals == 0) {
      return Failure(Quoted(word) + " is no NAME=VALUE: write " + (parameter != nullptr ? name : "NAME") +
                     "=VALUE, with the = and without blanks");
    }
    if (parameter == nullptr) return Failure(UnknownParameter(parameters, name));
    const Result<std::uint16_t> raw = ParseParameter(*parameter, std::string_view(word).substr(equals + 1));
    if (!raw) return Failure(raw.error());
    if (!wanted.emplace(parameter, *raw).second) return Failure(Quoted(name) + " is given twice");
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

ParameterChanges ParameterDiff(const ParameterValues& present, const ParameterValues& wanted) {
  ParameterChanges changes;
  for (const ParameterValue& value : wanted) {
    const ParameterValue* const now = ValueOf(*value.parameter, present);
    if (now != nullptr && now->raw != value.raw) changes.push_back({value.parameter, now->raw, value.raw});
  }
  return changes;
}

std::string ToText(const ParameterChanges& changes) {
  const std::size_t width = NameWidth(changes);
  std::string text;
  for (const ParameterChange& change : changes) {
    text += "  " + Left(change.parameter->name, width) + "  " +
            Right(ParameterText(*change.parameter, change.before), 8) + " -> " +
            ValueText({change.parameter, change.after}) + '\n';
  }
  return text;
}

Json ToJson(const ParameterChanges& changes) {
  Json list = Json::array();
  for (const ParameterChange& change : changes) {
    list.push_back({{"name", change.parameter->name},
                    {"unit", change.parameter->unit},
                    {"before", NumberOf(*change.parameter, change.before)},
                    {"after", NumberOf(*change.parameter, change.after)}});
  }
  return list;
}

double NumberOf(const ParameterSpec& parameter, std::uint16_t raw) {
  return raw / std::pow(10.0, parameter.decimals);
}

std::string ListText(Parameters parameters, const ParameterValues& values) {
  std::size_t width = 0;
  for (const ParameterSpec& parameter : parameters) width = std::max(width, parameter.name.size());
  std::string text;
  for (const ParameterSpec& parameter : parameters) {
    const ParameterValue* const value = ValueOf(parameter, values);
    text += Left(parameter.name, width) + "  " + Left(value != nullptr ? ValueText(*value) : "-", kValueWidth) +
            "  " + RangeText(parameter) + "\n    " + std::string(parameter.help) + '\n';
  }
  return text;
}

Json ListJson(Parameters parameters, const ParameterValues& values) {
  Json json = {{"parameters", Json::array()}};
  for (const ParameterSpec& parameter : parameters) {
    const ParameterValue* const value = ValueOf(parameter, values);
    Json entry = SpecJson(parameter);
    entry["value"] = value != nullptr ? Json(NumberOf(parameter, value->raw)) : Json(nullptr);
    json["parameters"].push_back(std::move(entry));
  }
  return json;
}

ParameterValues Chosen(const ParameterValues& values, const std::vector<std::string>& names) {
  if (names.empty()) return values;
  ParameterValues chosen;
  for (const std::string& name : names) {
    std::copy_if(values.begin(), values.end(), std::back_inserter(chosen),
                 [&name](const ParameterValue& value) { return value.parameter->name == name; });
  }
  return chosen;
}

std::string ToText(const ParameterValues& values) {
  const std::size_t width = NameWidth(values);
  std::string text;
  for (const ParameterValue& value : values) {
    text += Left(value.parameter->name, width) + "  " + ValueText(value) + '\n';
  }
  return text;
}

Json ToJson(const std::string& device, const ParameterValues& values) {
  Json json = {{"device", device}, {"parameters", Json::array()}};
  for (const ParameterValue& value : values) {
    Json entry = {{"name", value.parameter->name}, {"value", NumberOf(*value.parameter, value.raw)}};
    entry.update(SpecJson(*value.parameter));
    json["parameters"].push_back(std::move(entry));
  }
  return json;
}

std::string WriteText(const std::string& device, const ParameterChanges& changes,
                      const std::vector<CommandResult>& results) {
  if (changes.empty()) return device + ": nothing to write\n";
  if (AllVerified(results)) {
    return device + ": " + std::to_string(changes.size()) + " parameters written and read back\n";
  }
  std::string text = ToText(results.back());
  if (results.size() > 1) {
    text += "before it " + std::to_string(results.size() - 1) +
            " commands were carried out; axlecast param get shows what the device holds\n";
  }
  return text;
}

Json WriteJson(const std::string& device, const ParameterChanges& changes,
               const std::vector<CommandResult>& results) {
  Json json = {{"outcome", results.empty() ? Json("succeeded") : ToJson(results.back())["outcome"]},
               {"device", device},
               {"changes", ToJson(changes)},
               {"commands", Json::array()}};
  for (const CommandResult& result : results) json["commands"].push_back(ToJson(result));
  return json;
}

std::string ParameterFileText(const Family& family, const std::string& device, const ParameterValues& values) {
  std::string text =
      "# axlecast param import DEVICE FILE writes what differs.\nfamily: " + std::string(family.name) +
      "\ndevice: " + device + "\nparameters:\n";
  for (const ParameterValue& value : values) {
    text += "  " + std::string(value.parameter->name) + ": " + ParameterText(*value.parameter, value.raw) + "  # " +
            RangeText(*value.parameter) + '\n';
  }
  return text;
}

ParameterValues ParseParameterFile(const Family& family, const std::string& text, ConfigErrors& errors) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    errors.Add(YAML::Mark::null_mark(), "the file is empty: axlecast param export DEVICE writes one");
    return {};
  }
  const YAML::Node document = ParseYaml(text, errors);
  if (!document.IsDefined()) return {};
  ConfigMap top(document, "", errors);
  const std::string name = top.RequiredString("family");
  if (top.Has("family") && name != family.name) {
    top.Error("family", Quoted(name) + " is not the device's family " + Quoted(family.name));
    return {};
  }
  static_cast<void>(top.String("device", ""));  // where it was exported; another one may get it
  if (!top.Has("parameters")) top.Error("parameters", "is missing");
  ConfigMap map = top.Map("parameters");
  ParameterValues values;
  for (const ParameterSpec& parameter : family.parameters) {
    if (!map.Has(parameter.name)) continue;
    const Result<std::uint16_t> raw = ParseParameter(parameter, map.String(parameter.name, ""));
    if (raw) values.push_back({&parameter, *raw});
    if (!raw) map.Error(parameter.name, raw.error().text);
  }
  map.Done();
  top.Done();
  if (values.empty() && errors.empty()) top.Error("parameters", "holds none");
  return values;
}

}  // namespace axlecast
