#include "tools/axlecast/run/subcommands.h"

#include <sys/stat.h>
#include <CLI/CLI.hpp>

#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "core/base/text.h"
#include "platform/os/folder.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/run/isolation.h"

namespace axlecast {
namespace {

struct Options {
  ConfigOption config;
  std::vector<std::string> command;
  bool print = false;
};

// The network namespace of a process; 0 when it cannot be told.
ino_t NetworkOf(const std::string& process) {
  struct stat status {};
  return stat(("/proc/" + process + "/ns/net").c_str(), &status) == 0 ? status.st_ino : 0;
}

int Shell(const Options& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  const pid_t process = LockFile::Holder(RunDirectory(machine->machine) + "/up.lock");
  if (process == 0) {
    std::cerr << "machine " << machine->machine << " is not up for this user: start it with axlecast up --isolated "
              << machine->file << '\n';
    return kExitNoAnswer;
  }
  std::vector<std::string> command = options.command.empty() ? std::vector{LoginShell()} : options.command;
  if (const ino_t network = NetworkOf(std::to_string(process)); network != 0 && network != NetworkOf("self")) {
    command = EntryArguments(process, command);
  } else if (options.command.empty() && !options.print) {
    std::cerr << "machine " << machine->machine << " is up, and not isolated: this shell reaches it already\n";
    return kExitDone;
  }
  if (options.print) {
    std::cout << ShellText(command) << '\n';
    return kExitDone;
  }
  std::cerr << Become(command).text << '\n';
  return kExitBad;
}

}  // namespace

void AddShellCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("shell", "Opens a shell in the network of a machine that is up --isolated");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command->add_option("--run", options->command, "Run this instead of a shell; everything after it belongs to it")
      ->expected(1, 1'000)
      ->type_name("COMMAND...");
  command->add_flag("--print", options->print, "Only show the command");
  command->footer(
      "examples:\n"
      "  axlecast shell config/demo.yaml\n"
      "  axlecast shell config/demo.yaml --run lcm-logger demo.lcm");
  command->callback([options, &exit_code] { exit_code = Shell(*options); });
}

}  // namespace axlecast
