#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <utility>

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

}  // namespace axlecast
