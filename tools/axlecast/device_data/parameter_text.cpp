#include "tools/axlecast/device_data/parameter_text.h"

#include <algorithm>

#include "core/base/text.h"
#include "tools/axlecast/common/exit_code.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kValueWidth = 12;  // "1000.0 W"

std::size_t NameWidth(const ParameterValues& values) {
  std::size_t width = 0;
  for (const ParameterValue& value : values) width = std::max(width, value.parameter->name.size());
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

// Null when the device's value is not known.
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

}  // namespace axlecast
