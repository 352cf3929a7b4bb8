#pragma once

namespace CLI {
class App;
}

namespace axlecast {

// Each function adds the subcommands that its comment names to `app`, or to the subcommand that its argument names.
// A subcommand stores the exit code of the process in `exit_code` when it has run.

// spy: runs lcm-spy on the LCM URL of the machine, with the message types of axlecast
void AddSpyCommand(CLI::App& app, int& exit_code);
// status: the state of the machine
void AddStatusCommand(CLI::App& app, int& exit_code);
// info: the state of one device
void AddInfoCommand(CLI::App& app, int& exit_code);
// watch: the messages of the machine as they arrive
void AddWatchCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
