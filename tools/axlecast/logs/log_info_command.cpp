#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "core/messages/json/field.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/log_summary.h"
#include "tools/log/log_header.h"

namespace axlecast {
namespace {

struct Options {
  std::string file;
  std::string show;
  bool json = false;
};

const std::map<std::string, std::string_view> kHeaders = {
    {"machine", kMachineChannel}, {"schema", kSchemaChannel}, {"recorder", kRecorderChannel}};

// A header stands before all others, but a log may hold several: the newest.
int ShowHeader(const Options& options, const LogSummary& summary) {
  const auto text = summary.Header(kHeaders.at(options.show));
  if (!text) {
    std::cerr << options.file << " holds no " << options.show
              << ": `axlecast record` writes it, lcm-logger does not\n";
    return kExitBad;
  }
  static_cast<void>(WriteOut(*text + (text->ends_with('\n') ? "" : "\n")));
  return kExitDone;
}

int Run(const Options& options) {
  LogInput input;
  if (!input.Open(options.file)) return kExitBad;
  LogSummary summary;
  input.Read("reading", [&summary](const LogEvent& event, std::size_t) {
    summary.Add(event);
    return true;
  });
  if (!options.show.empty()) return ShowHeader(options, summary);
  const int exit_code = input.ExitCode();
  if (exit_code == kExitBad) return exit_code;
  const std::size_t size = input.log().size();
  static_cast<void>(WriteOut(options.json
                                 ? JsonLine(SummaryJson(options.file, size, summary, input.damage())) + '\n'
                                 : SummaryText(options.file, size, summary, input.damage())));
  return exit_code;
}

}  // namespace

void AddLogInfoCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = log.add_subcommand("info", "What a log holds: channels, rates, gaps, losses, damage");
  command->add_option("LOG", options->file, "The log")->required();
  CLI::Option* show = command->add_option("--show", options->show, "Only this part of its head, as it is")
                          ->check(CLI::IsMember({"machine", "schema", "recorder"}))
                          ->type_name("machine|schema|recorder");
  command->add_flag("--json", options->json, "One JSON object")->excludes(show);
  command->footer(std::string("GAP is the longest time between two events of the channel; LOST counts messages of "
                              "axlecast's types that\nare missing by their numbers.\n"
                              "examples:\n"
                              "  axlecast log info run.log\n"
                              "  axlecast log info run.log --json | jq '.channels[] | {channel, hz, lost}'\n"
                              "  axlecast log info run.log --show machine > machine.yaml\n") +
                  kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
