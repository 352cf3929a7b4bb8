#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "core/config/machine_config.h"
#include "tools/axlecast/common/config_option.h"

namespace axlecast {

// The bridge's journal of a command: --journal FILE, else the one of the machine's file.
class JournalOption {
 public:
  // Adds --journal and --config. The object must outlive the parsing.
  void AddTo(CLI::App& command);

  struct Place {
    std::string file;
    std::optional<MachineConfig> machine;  // none where only --journal was given
  };
  // When there is none, says why on standard error and sets `exit_code`.
  [[nodiscard]] std::optional<Place> Find(int& exit_code) const;

 private:
  ConfigOption config_;
  std::string journal_;
};

}  // namespace axlecast
