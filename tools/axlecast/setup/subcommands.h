#pragma once

namespace CLI {
class App;
}

namespace axlecast {

// Each function adds the subcommands that its comment names to `app`, or to the subcommand that its argument names.
// A subcommand stores the exit code of the process in `exit_code` when it has run.

// check-config: reads the machine file as every process does, and reports the result
void AddCheckConfigCommand(CLI::App& app, int& exit_code);
// doctor: checks this host, and prints the lines that fix it
void AddDoctorCommand(CLI::App& app, int& exit_code);
// hwtest
void AddHwtestCommand(CLI::App& app, int& exit_code);
// keygen: creates signing keys. Its process must not write a core file
void AddKeygenCommand(CLI::App& app, int& exit_code);
// report
void AddReportCommand(CLI::App& app, int& exit_code);
// scan
void AddScanCommand(CLI::App& app, int& exit_code);
// ssi-plan: calculates the clock that a cable allows (docs/cli.md)
void AddSsiPlanCommand(CLI::App& app, int& exit_code);

}  // namespace axlecast
