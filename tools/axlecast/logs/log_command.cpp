#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/log_report.h"
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

// Prints the newest header event of this kind: a merged or continued log may contain several.
int ShowHeader(const LogInfoOptions& options, const LogSummary& summary) {
  const auto text = summary.Header(kHeaders.at(options.show));
  if (!text) {
    return Fail(
        options.file + " does not contain " + options.show + ": `axlecast record` writes it, lcm-logger does not",
        kExitBad);
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
  Show(SummaryJson(options.file, size, summary, input.damage()),
       SummaryText(options.file, size, summary, input.damage()), options.json);
  return exit_code;
}

constexpr std::size_t kBuffer = 64U << 10;

struct LogCatOptions {
  std::string file;
  LogFilter filter;
  bool raw = false;
};

int RunLogCat(LogCatOptions& options) {
  LogInput input;
  if (!input.Open(options.file)) return kExitBad;
  if (const Result<> parsed = options.filter.Parse(input.log()); !parsed)
    return Fail(parsed.error().text, kExitUsage);
  std::string lines;
  bool has_reader = true;
  OnBase base;
  input.Read("", [&](const LogEvent& event, std::size_t) {
    base.Take(event.data, ArrivalOf(event));
    if (options.filter.Matches(event)) lines += EventLine(event, options.raw, base);
    if (lines.size() < kBuffer) return true;
    has_reader = WriteOut(lines);
    lines.clear();
    return has_reader;
  });
  if (!has_reader) return kExitDone;
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
  const LogCheck::Report& report = check.Finish();
  const int exit_code = input.ExitCode();
  if (exit_code == kExitBad) return exit_code;
  Show(CheckJson(options.file, report, input.damage()), CheckText(options.file, report, input.damage()),
       options.json);
  return report.IsSound() ? exit_code : kExitLosses;
}

}  // namespace

void AddLogCommand(CLI::App& app, int& exit_code) {
  CLI::App* log = app.add_subcommand("log", "Show, verify, filter, merge, repair and convert LCM event logs");
  log->require_subcommand(1);
  AddLogInfoCommand(*log, exit_code);
  AddLogCatCommand(*log, exit_code);
  AddLogFilterCommand(*log, exit_code);
  AddLogMergeCommand(*log, exit_code);
  AddLogRepairCommand(*log, exit_code);
  AddLogVerifyCommand(*log, exit_code);
  AddLogConvertCommand(*log, exit_code);
  AddLogPlotCommand(*log, exit_code);
  log->footer(std::string("Reads logs of axlecast record, of lcm-logger and of any other program that writes LCM's "
                          "format, even if they\n"
                          "are damaged.\n") +
              kLogExitCodes);
}

void AddLogInfoCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogInfoOptions>();
  CLI::App* command =
      log.add_subcommand("info", "Show the content of a log: channels, rates, gaps, losses, damage");
  command->add_option("LOG", options->file, "The log")->required();
  CLI::Option* show = command->add_option("--show", options->show, "Print only this header event, unchanged")
                          ->check(CLI::IsMember({"machine", "schema", "recorder"}))
                          ->type_name("machine|schema|recorder");
  command->add_flag("--json", options->json, "Print one JSON object")->excludes(show);
  command->footer(std::string("GAP is the longest time between two events of the channel. LOST is the number of "
                              "messages of axlecast's types\n"
                              "that are missing by their sequence numbers.\n"
                              "examples:\n"
                              "  axlecast log info run.log\n"
                              "  axlecast log info run.log --json | jq '.channels[] | {channel, hz, lost}'\n"
                              "  axlecast log info run.log --show machine > machine.yaml\n") +
                  kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = RunLogInfo(*options); });
}

void AddLogCatCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogCatOptions>();
  CLI::App* command = log.add_subcommand("cat", "Print the events of a log as JSON, one line each");
  command->add_option("LOG", options->file, "The log")->required();
  options->filter.AddTo(*command);
  command->add_flag("--raw", options->raw, "Print all data in hex, even if it can be decoded");
  command->footer(
      std::string("received_utime is the time of reception by the recorder, utime that of the message.\n"
                  "examples:\n"
                  "  axlecast log cat run.log --channel '^ALARM/'\n"
                  "  axlecast log cat run.log --from 10 --until 12.5 --channel POSITION/axis1 | jq .value\n"
                  "  axlecast log cat run.log --from 2026-11-21T07:00 --until 2026-11-21T07:05\n") +
      kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = RunLogCat(*options); });
}

void AddLogVerifyCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogVerifyOptions>();
  CLI::App* command = log.add_subcommand("verify", "Check the structure, numbers, times and seals of a log");
  command->add_option("LOG", options->file, "The log")->required();
  command->add_flag("--json", options->json, "Print one JSON object");
  command->footer(std::string("LCM's log has no checksums: changed content is detected only in logs with the seals "
                              "of `axlecast record`.\n"
                              "Missing events, and messages that were lost before they were recorded, count as "
                              "losses. Numbers that begin\n"
                              "again and times that run back are reported, but do not count as losses.\n"
                              "examples:\n"
                              "  axlecast log verify run.log\n"
                              "  axlecast log verify run.log --json | jq .damage\n") +
                  kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = RunLogVerify(*options); });
}

}  // namespace axlecast
