#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "core/messages/json/field.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_check.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/log_summary.h"
#include "tools/axlecast/logs/subcommands.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

struct LogInfoOptions {
  std::string file;
  std::string show;
  bool json = false;
};

const std::map<std::string, std::string_view> kHeaders = {
    {"machine", kMachineChannel}, {"schema", kSchemaChannel}, {"recorder", kRecorderChannel}};

// A header stands before all others, but a log may hold several: the newest.
int ShowHeader(const LogInfoOptions& options, const LogSummary& summary) {
  const auto text = summary.Header(kHeaders.at(options.show));
  if (!text) {
    std::cerr << options.file << " holds no " << options.show
              << ": `axlecast record` writes it, lcm-logger does not\n";
    return kExitBad;
  }
  static_cast<void>(WriteOut(*text + (text->ends_with('\n') ? "" : "\n")));
  return kExitDone;
}

int RunLogInfo(const LogInfoOptions& options) {
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

constexpr std::size_t kBuffer = 64U << 10;

struct LogCatOptions {
  std::string file;
  LogChoice choice;
  bool raw = false;
};

int RunLogCat(LogCatOptions& options) {
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

struct LogVerifyOptions {
  std::string file;
  bool json = false;
};

int RunLogVerify(const LogVerifyOptions& options) {
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

void AddLogCommand(CLI::App& app, int& exit_code) {
  CLI::App* log =
      app.add_subcommand("log", "LCM event logs: what they hold, whether they are sound, parts of them");
  log->require_subcommand(1);
  AddLogInfoCommand(*log, exit_code);
  AddLogCatCommand(*log, exit_code);
  AddLogFilterCommand(*log, exit_code);
  AddLogMergeCommand(*log, exit_code);
  AddLogRepairCommand(*log, exit_code);
  AddLogVerifyCommand(*log, exit_code);
  AddLogConvertCommand(*log, exit_code);
  AddLogPlotCommand(*log, exit_code);
  log->footer(
      std::string("Logs of axlecast record, of lcm-logger, and of any other program that writes LCM's format;"
                  " damaged ones too.\n") +
      kLogExitCodes);
}

void AddLogInfoCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogInfoOptions>();
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
  command->callback([options, &exit_code] { exit_code = RunLogInfo(*options); });
}

void AddLogCatCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogCatOptions>();
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
  command->callback([options, &exit_code] { exit_code = RunLogCat(*options); });
}

void AddLogVerifyCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogVerifyOptions>();
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
  command->callback([options, &exit_code] { exit_code = RunLogVerify(*options); });
}

}  // namespace axlecast
