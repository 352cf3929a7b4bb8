#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The machine's file, found in the same way by every subcommand: CONFIG or --config FILE, else $AXLECAST_CONFIG, else
// ./machine.yaml, else /etc/axlecast/machine.yaml.
class ConfigOption {
 public:
  enum class Form { kPositional, kOptionOnly };

  // Adds [CONFIG] (unless kOptionOnly) and --config to `command`. The object must outlive the parsing.
  void AddTo(CLI::App& command, Form form);

  void Set(std::string file) { given_ = std::move(file); }
  [[nodiscard]] bool Given() const { return !given_.empty(); }
  // Returns the file, or an empty text if none is given and no default exists.
  [[nodiscard]] std::string File() const;

  // Reads and checks the file; with `only_bus`, only the part of this bus. An error contains one or more lines, each with its newline.
  [[nodiscard]] Result<MachineConfig> Load(std::string_view only_bus = {}) const;
  // Prints an error of Load to standard error. Returns the exit code: kExitUsage if there is no file, else kExitBad.
  [[nodiscard]] int Fail(const Error& error) const;

 private:
  std::string given_;
};

// Sets the callback of `command`: loads the file of `options->config`, and calls `run` with the machine. Stores the exit code
// of `run`, or of a failed Load.
template <typename Options>
void RunOnMachine(CLI::App& command, const std::shared_ptr<Options>& options, int& exit_code,
                  const std::function<int(const MachineConfig&, Options&)>& run) {
  command.callback([options, &exit_code, run] {
    const auto machine = options->config.Load();
    exit_code = machine ? run(*machine, *options) : options->config.Fail(machine.error());
  });
}

// Adds --host NAME to `command`, for ThisHost.
void AddHostOption(CLI::App& command, std::string& host);

// Formats the keys that were read from a file, one per line: place, kind, range and default.
[[nodiscard]] std::string ConfigKeysText(const std::vector<ConfigKey>& keys);
// Returns the same as a list of objects: place, kind (null if only its presence matters), range, default (or null),
// required.
[[nodiscard]] nlohmann::ordered_json ConfigKeysJson(const std::vector<ConfigKey>& keys);

// Returns the systemd units of `machine`: a driver per bus, the bridge, and the recorder, the shipper, the time base, the sets and the simulators if
// they are configured.
[[nodiscard]] std::vector<std::string> MachineUnits(const MachineConfig& machine);

// Returns the names of the machine's buses, or of its devices, in the order of the file.
[[nodiscard]] std::vector<std::string> MachineNames(const MachineConfig& machine, bool devices);

}  // namespace axlecast
