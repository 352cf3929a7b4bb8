#include "tools/axlecast/log_filter_command.h"

#include <iostream>
#include <memory>
#include <string>

#include "tools/axlecast/exit_code.h"
#include "tools/axlecast/log_input.h"
#include "tools/axlecast/log_output.h"
#include "tools/log/log_header.h"

namespace axlecast {
namespace {

struct Options {
  std::string in;
  std::string out;
  LogChoice choice;
  bool force = false;
};

int Run(Options& options) {
  const MappedFile file(options.in);
  if (!file.problem().empty()) {
    std::cerr << file.problem() << '\n';
    return kExitBad;
  }
  const Bytes log = file.bytes();
  if (const std::string problem = options.choice.Understand(LogStart(log)); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitUsage;
  }
  LogReader reader(log);
  LogOutput out(options.out, file.mode());
  std::int64_t events = 0;
  {
    LogProgress progress("filtering", log.size());
    for (auto event = reader.Next(); event && out.problem().empty(); event = reader.Next()) {
      ++events;
      if (IsLogChannel(event->channel) || options.choice.Takes(*event)) out.Add(*event);
      progress.At(reader.position());
    }
  }
  if (events == 0 && !log.empty()) return LogExitCode(options.in, log, events, reader.damage());
  if (const std::string problem = out.Commit(options.force); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitFailed;
  }
  std::cerr << DamageText(options.in, reader.damage()) << options.out << ": " << out.events() << " of " << events
            << " events\n";
  return LogExitCode(options.in, log, events, reader.damage());
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
                  "  axlecast log filter run.log minute.log --from 5m --to 6m\n") +
      kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
