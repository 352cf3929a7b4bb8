#pragma once

namespace CLI {
class App;
}

namespace axlecast {

// Each function adds the subcommands that its comment names to `app`, or to the subcommand that its argument names.
// A subcommand stores the exit code of the process in `exit_code` when it has run.

// backup, restore
void AddBackupCommands(CLI::App& app, int& exit_code);
// param list|get|set|export|import
void AddParamCommand(CLI::App& app, int& exit_code);
// replace: the guided exchange of a device
void AddReplaceCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
