#include "tools/axlecast/common/config_option.h"

#include <unistd.h>

#include <cstdlib>
#include <iostream>

#include "core/config/load.h"
#include "tools/axlecast/common/exit_code.h"

namespace axlecast {

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

std::optional<MachineConfig> ConfigOption::Load(int& exit_code) const {
  const std::string file = File();
  if (file.empty()) {
    std::cerr << "no machine's file: give one (CONFIG or --config FILE), set AXLECAST_CONFIG, or put it at "
                 "./machine.yaml or /etc/axlecast/machine.yaml\n";
    exit_code = kExitUsage;
    return std::nullopt;
  }
  ConfigErrors errors(file);
  std::optional<MachineConfig> machine = LoadConfig(file, errors);
  if (!machine) {
    std::cerr << errors.Text();
    exit_code = kExitBad;
  }
  return machine;
}

}  // namespace axlecast
