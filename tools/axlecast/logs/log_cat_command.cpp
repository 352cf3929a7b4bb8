#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_choice.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/log_line.h"

namespace axlecast {
namespace {

constexpr std::size_t kBuffer = 64U << 10;

struct Options {
  std::string file;
  LogChoice choice;
  bool raw = false;
};

int Run(Options& options) {
  LogInput input;
  if (!input.Open(options.file)) return kExitBad;
  if (const std::string problem = options.choice.Understand(input.log()); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitUsage;
  }
  std::string lines;
  bool wanted = true;
  input.Read("", [&](const LogEvent& event, std::size_t) {
    if (options.choice.Takes(event)) lines += EventLine(event, options.raw);
    if (lines.size() < kBuffer) return true;
    wanted = WriteOut(lines);
    lines.clear();
    return wanted;
  });
  if (!wanted) return kExitDone;  // its reader has seen enough
  static_cast<void>(WriteOut(lines));
  std::cerr << DamageText(options.file, input.damage());
  return input.ExitCode();
}

}  // namespace

void AddLogCatCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = log.add_subcommand("cat", "The events of a log as JSON, one line each");
  command->add_option("LOG", options->file, "The log")->required();
  options->choice.AddTo(*command);
  command->add_flag("--raw", options->raw, "Data in hex, also of messages that could be decoded");
  command->footer(
      std::string("received_utime is the recorder's time of reception, utime the message's own.\n"
                  "examples:\n"
                  "  axlecast log cat run.log --channel '^ALARM/'\n"
                  "  axlecast log cat run.log --from 10 --until 12.5 --channel POSITION/axis1 | jq .value\n"
                  "  axlecast log cat run.log --from 2026-11-21T07:00 --until 2026-11-21T07:05\n") +
      kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
