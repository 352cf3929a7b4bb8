#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>

#include "core/messages/json/field.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_check.h"
#include "tools/axlecast/logs/log_input.h"

namespace axlecast {
namespace {

struct Options {
  std::string file;
  bool json = false;
};

int Run(const Options& options) {
  LogInput input;
  if (!input.Open(options.file)) return kExitBad;
  LogCheck check;
  input.Read("verifying", [&](const LogEvent& event, std::size_t offset) {
    check.Add(event, offset, input.log().subspan(offset, EventSize(event)));
    return true;
  });
  check.Finish();
  const int exit_code = input.ExitCode();
  if (exit_code == kExitBad) return exit_code;
  static_cast<void>(WriteOut(options.json ? JsonLine(CheckJson(options.file, check, input.damage())) + '\n'
                                          : CheckText(options.file, check, input.damage())));
  return check.sound() ? exit_code : kExitLosses;
}

}  // namespace

void AddLogVerifyCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = log.add_subcommand("verify", "Whether a log is sound: structure, numbers, times, seals");
  command->add_option("LOG", options->file, "The log")->required();
  command->add_flag("--json", options->json, "One JSON object");
  command->footer(
      std::string("LCM's log has no checksums: only where `axlecast record` left its seals can a changed "
                  "content be found.\n"
                  "Events that are missing, and messages that were lost before they were recorded, count "
                  "as losses; numbers that\nbegin anew and times that run back are only told.\n"
                  "examples:\n"
                  "  axlecast log verify run.log\n"
                  "  axlecast log verify run.log --json | jq .damage\n") +
      kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
