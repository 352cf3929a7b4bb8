#include "tools/axlecast/device_data/parameter_file.h"

#include "core/base/spelling.h"
#include "core/config/yaml_text.h"
#include "core/device/parameter.h"

namespace axlecast {

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
    std::string problem;
    const auto raw = ParseParameter(parameter, map.String(parameter.name, ""), problem);
    if (raw) values.push_back({&parameter, *raw});
    if (!raw) map.Error(parameter.name, problem);
  }
  map.Done();
  top.Done();
  if (values.empty() && errors.empty()) top.Error("parameters", "holds none");
  return values;
}

}  // namespace axlecast
