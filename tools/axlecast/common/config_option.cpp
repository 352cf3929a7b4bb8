#include "tools/axlecast/common/config_option.h"

#include <unistd.h>
#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <optional>

#include "core/base/text.h"
#include "core/config/load.h"
#include "tools/axlecast/common/terminal.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string KindOf(const ConfigKey& key) { return key.kind.empty() ? "text" : key.kind; }

std::string Default(const ConfigKey& key) {
  if (key.required) return "required";
  return key.fallback.empty() ? "" : "default " + key.fallback;
}

Json OrNull(const std::string& text) { return text.empty() ? Json() : Json(text); }

}  // namespace

void ConfigOption::AddTo(CLI::App& command, Form form) {
  CLI::Option* option = command
                            .add_option("--config", given_,
                                        "The machine's file; else $AXLECAST_CONFIG, ./machine.yaml, "
                                        "/etc/axlecast/machine.yaml")
                            ->type_name("FILE");
  if (form == Form::kPositional) command.add_option("CONFIG", given_, "The machine's file")->excludes(option);
}

std::string ConfigOption::File() const {
  if (!given_.empty()) return given_;
  if (const char* file = std::getenv("AXLECAST_CONFIG"); file != nullptr && *file != '\0') return file;
  for (const char* file : {"machine.yaml", "/etc/axlecast/machine.yaml"}) {
    if (access(file, F_OK) == 0) return file;
  }
  return "";
}

Result<MachineConfig> ConfigOption::Load(std::string_view only_bus) const {
  const std::string file = File();
  if (file.empty()) {
    return Failure(
        "no machine's file: give one (CONFIG or --config FILE), set AXLECAST_CONFIG, or put it at ./machine.yaml "
        "or "
        "/etc/axlecast/machine.yaml\n");
  }
  ConfigErrors errors(file);
  std::optional<MachineConfig> machine = LoadConfig(file, errors, only_bus);
  if (!machine) return Failure(errors.Text());
  return *std::move(machine);
}

int ConfigOption::Fail(const Error& error) const {
  std::cerr << error.text;
  return File().empty() ? kExitUsage : kExitBad;
}

std::string ConfigKeysText(const std::vector<ConfigKey>& keys) {
  constexpr std::size_t kKindWidth = 22;
  std::size_t width = 0;
  for (const ConfigKey& key : keys) width = std::max(width, key.place.size());
  std::string text;
  for (const ConfigKey& key : keys) {
    std::string line = Left(key.place, width) + "  " + Left(KindOf(key), kKindWidth) + Default(key);
    if (!key.range.empty()) line += (Default(key).empty() ? "" : "; ") + key.range;
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

Json ConfigKeysJson(const std::vector<ConfigKey>& keys) {
  Json list = Json::array();
  for (const ConfigKey& key : keys) {
    list.push_back({{"place", key.place},
                    {"kind", OrNull(key.kind)},
                    {"range", OrNull(key.range)},
                    {"default", OrNull(key.required ? "" : key.fallback)},
                    {"required", key.required}});
  }
  return list;
}

void AddHostOption(CLI::App& command, std::string& host) {
  command
      .add_option("--host", host,
                  "Name of this host in the machine's file (default: its host name up to the first dot)")
      ->type_name("NAME");
}

std::vector<std::string> MachineUnits(const MachineConfig& machine) {
  std::vector<std::string> units;
  if (machine.runs_bridge) units.emplace_back("axlecast-bridge.service");
  if (!machine.recorder.logs.empty()) units.emplace_back("axlecast-record.service");
  if (!machine.ship.database.empty()) units.emplace_back("axlecast-ship.service");
  if (!machine.time.root.empty()) units.emplace_back("axlecast-time.service");
  if (!machine.sets.empty()) units.emplace_back("axlecast-sets.service");
  if (std::any_of(machine.buses.begin(), machine.buses.end(), [](const BusConfig& bus) { return bus.simulate; })) {
    units.emplace_back("axlecast-simulate.service");
  }
  for (const BusConfig& bus : machine.buses) units.push_back("axlecast-driver@" + bus.name + ".service");
  return units;
}

std::vector<std::string> MachineNames(const MachineConfig& machine, bool devices) {
  std::vector<std::string> names;
  for (const BusConfig& bus : machine.buses) {
    if (!devices) names.push_back(bus.name);
    for (const DeviceConfig& device : bus.devices) {
      if (devices) names.push_back(device.name);
    }
  }
  return names;
}

}  // namespace axlecast
