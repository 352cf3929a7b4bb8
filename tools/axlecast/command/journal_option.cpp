#include "tools/axlecast/command/journal_option.h"

#include <utility>

namespace axlecast {

void JournalOption::AddTo(CLI::App& command) {
  config_.AddTo(command, ConfigOption::Form::kOptionOnly);
  command.add_option("--journal", journal_, "The bridge's journal; else the one of the machine's file")
      ->type_name("FILE");
}

std::optional<JournalOption::Place> JournalOption::Find(int& exit_code) const {
  if (!journal_.empty() && !config_.Given()) return Place{.file = journal_, .machine = std::nullopt};
  std::optional<MachineConfig> machine = config_.Load(exit_code);
  if (!machine) return std::nullopt;
  std::string file = journal_.empty() ? JournalFile(*machine) : journal_;
  return Place{.file = std::move(file), .machine = std::move(machine)};
}

}  // namespace axlecast
