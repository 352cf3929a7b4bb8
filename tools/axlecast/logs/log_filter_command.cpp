#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/logs/log_choice.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/log_output.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

struct Options {
  std::string in;
  std::string out;
  LogChoice choice;
  bool force = false;
};

int Run(Options& options) {
  LogInput input;
  if (!input.Open(options.in)) return kExitBad;
  if (const std::string problem = options.choice.Understand(input.log()); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitUsage;
  }
  LogOutput out(options.out, input.file().mode());
  input.Read("filtering", [&](const LogEvent& event, std::size_t) {
    if (IsLogChannel(event.channel) || options.choice.Takes(event)) out.Add(event);
    return out.problem().empty();
  });
  const int exit_code = input.ExitCode();
  if (exit_code == kExitBad) return exit_code;
  if (const std::string problem = out.Commit(options.force); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitFailed;
  }
  std::cerr << DamageText(options.in, input.damage()) << options.out << ": " << out.events() << " of "
            << input.events() << " events\n";
  return exit_code;
}

}  // namespace

void AddLogFilterCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = log.add_subcommand("filter", "A part of a log as a log of its own");
  command->add_option("IN", options->in, "The log")->required();
  command->add_option("OUT", options->out, "The new log")->required();
  options->choice.AddTo(*command);
  command->add_flag("--force", options->force, "Replaces OUT when it is there already");
  command->footer(
      std::string("The machine's file and the message types at the head of the log stay in it; its events "
                  "are numbered from 0\nand sealed anew.\n"
                  "examples:\n"
                  "  axlecast log filter run.log axis1.log --channel '/axis1$'\n"
                  "  axlecast log filter run.log quiet.log --channel '^(POSITION|WIRE)' --invert\n"
                  "  axlecast log filter run.log minute.log --from 5m --until 6m\n") +
      kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
