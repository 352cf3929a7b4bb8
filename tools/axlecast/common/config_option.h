#pragma once

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The machine's file of a command, found the same way by every command: the positional CONFIG or --config FILE,
// else $AXLECAST_CONFIG, else ./machine.yaml, else /etc/axlecast/machine.yaml.
class ConfigOption {
 public:
  enum class Form { kPositional, kOptionOnly };

  // Adds [CONFIG] (unless kOptionOnly) and --config to `command`. The object must outlive the parsing.
  void AddTo(CLI::App& command, Form form);

  void Set(std::string file) { given_ = std::move(file); }
  [[nodiscard]] bool Given() const { return !given_.empty(); }
  // Empty when nothing was given and none of the usual files exists.
  [[nodiscard]] std::string File() const;

  // Reads and checks the file. When it cannot be used, says why on standard error and sets `exit_code`:
  // kExitUsage without a file, kExitBad for one with errors.
  [[nodiscard]] std::optional<MachineConfig> Load(int& exit_code) const;

 private:
  std::string given_;
};

// Every key that a file was asked for, a line each: where it stands, what it is, its range, what holds without it.
[[nodiscard]] std::string ConfigKeysText(const std::vector<ConfigKey>& keys);
// The same as a list of objects: place, kind (null: only its presence was asked for), range, default (null: none), required.
[[nodiscard]] nlohmann::ordered_json ConfigKeysJson(const std::vector<ConfigKey>& keys);

// The systemd units that `machine` consists of, by its file: a driver for each bus, the bridge, the recorder where logs
// are named, the simulators where a bus has them.
[[nodiscard]] std::vector<std::string> MachineUnits(const MachineConfig& machine);

// The names of its buses, or of its devices, in the file's order.
[[nodiscard]] std::vector<std::string> MachineNames(const MachineConfig& machine, bool devices);

}  // namespace axlecast
