#include "tools/axlecast/device_data/parameter_diff.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/device/parameter.h"

namespace axlecast {

ParameterChanges ParameterDiff(const ParameterValues& present, const ParameterValues& wanted) {
  ParameterChanges changes;
  for (const ParameterValue& value : wanted) {
    const auto now = std::find_if(present.begin(), present.end(),
                                  [&](const ParameterValue& other) { return other.parameter == value.parameter; });
    if (now != present.end() && now->raw != value.raw) changes.push_back({value.parameter, now->raw, value.raw});
  }
  return changes;
}

std::string ToText(const ParameterChanges& changes) {
  std::size_t width = 0;
  for (const ParameterChange& change : changes) width = std::max(width, change.parameter->name.size());
  std::string text;
  for (const ParameterChange& change : changes) {
    text += "  " + Left(change.parameter->name, width) + "  " +
            Right(ParameterText(*change.parameter, change.before), 8) + " -> " +
            ValueText({change.parameter, change.after}) + '\n';
  }
  return text;
}

nlohmann::ordered_json ToJson(const ParameterChanges& changes) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
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

}  // namespace axlecast
