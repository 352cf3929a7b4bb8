#pragma once

namespace CLI {
class App;
}

namespace axlecast {

// Each function adds the subcommands that its comment names to `app`, or to the subcommand that its argument names.
// A subcommand stores the exit code of the process in `exit_code` when it has run.

// driver BUS: replaces this process by the driver program of the family of the bus
void AddDriverCommand(CLI::App& app, int& exit_code);
// mqtt
void AddMqttCommand(CLI::App& app, int& exit_code);
// shell
void AddShellCommand(CLI::App& app, int& exit_code);
// simulate: runs the simulators of the buses of a machine, or queries and changes running ones
void AddSimulateCommand(CLI::App& app, int& exit_code);
// up: runs the whole machine in the foreground
void AddUpCommand(CLI::App& app, int& exit_code);
// web; only in a build with AXLECAST_WEB
void AddWebCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
