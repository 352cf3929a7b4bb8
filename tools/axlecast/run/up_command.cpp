#include "tools/axlecast/run/subcommands.h"

#include <unistd.h>
#include <CLI/CLI.hpp>

#include <iostream>
#include <memory>

#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/run/isolation.h"
#include "tools/axlecast/run/machine_run.h"

namespace axlecast {
namespace {

struct UpOptions {
  ConfigOption config;
  double seconds = 0;
  bool isolated = false;
  bool no_table = false;
  bool json = false;
  bool web = false;
};

// The line that gives a shell in this process's network.
std::string Entry() { return ShellText(EntryArguments(getpid(), {LoginShell()})); }

int Up(const UpOptions& options) {
  int exit_code = kExitDone;
  const auto machine = options.config.Load(exit_code);
  if (!machine) return exit_code;
  if (options.isolated) {
    if (const std::string problem = EnterIsolation(); !problem.empty()) {
      std::cerr << problem << '\n';
      return kExitBad;
    }
    std::cerr << "isolated: a shell inside, in which every program reaches the machine (later: axlecast shell "
              << options.config.File() << "):\n  " << Entry() << '\n';
  }
  const bool table = !options.no_table && !options.json && Screen::Usable();
  MachineRun run(*machine, options.config.File(), table, options.json);
  if (options.isolated) run.AddNote("isolated; a shell inside: " + Entry());
  if (options.web) {
    const std::string page =
        "page: " + WebUrl(machine->web, HostName()) + (options.isolated ? " (for a browser that gets in)" : "");
    std::cerr << page << '\n';
    run.AddNote(page);
    run.AddWeb();
  }
  if (const std::string problem = run.Prepare(); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitBad;
  }
  std::cerr << "logs: " << RunDirectory(machine->machine) << "/log\n";
  const RunSummary summary = run.Run(options.seconds);
  static_cast<void>(WriteOut(options.json ? summary.json + '\n' : summary.text));
  // Without an end of its own the run ends when the operator wants it to: that is no fault.
  return summary.Good() || options.seconds == 0 ? kExitDone : kExitBad;
}

}  // namespace

void AddUpCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<UpOptions>();
  CLI::App* command = app.add_subcommand("up", "Runs the whole machine: simulators, drivers, bridge, a live table");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command
      ->add_option("--seconds", options->seconds,
                   "End after so long with a summary; exit code 0 only after a good run")
      ->check(CLI::Range(0.1, 1e9))
      ->type_name("N");
  command->add_flag("--isolated", options->isolated, "In a network namespace of its own");
  command->add_flag("--no-table", options->no_table, "A line every 5 s instead of the live table");
  command->add_flag("--json", options->json, "The summary as one JSON object; no table");
  command->add_flag("--web", options->web, "With its page for browsers (axlecast web)");
  command->footer(
      "examples:\n"
      "  axlecast up config/demo.yaml                 live until Ctrl-C\n"
      "  axlecast up config/demo.yaml --web           with its page in the browser\n"
      "  axlecast up config/demo.yaml --seconds 10    no terminal needed\n"
      "  axlecast up config/demo.yaml --isolated      where multicast is not usable");
  command->callback([options, &exit_code] { exit_code = Up(*options); });
}

}  // namespace axlecast
