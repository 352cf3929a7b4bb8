#include "tools/axlecast/logs/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/log_output.h"
#include "tools/log/log_event.h"
#include "tools/log/log_merge.h"

namespace axlecast {
namespace {

struct Options {
  std::vector<std::string> files;  // the last one is written
  bool force = false;
};

// The headers of all logs before everything else, as if received with the merged log's first event.
void AddHeaders(const std::vector<MappedFile>& logs, LogOutput& out) {
  std::vector<LogEvent> headers;
  std::int64_t start = INT64_MAX;
  for (const MappedFile& log : logs) {
    LogReader reader(log.bytes());
    for (auto event = reader.Next(); event; event = reader.Next()) {
      start = std::min(start, event->utime);
      if (!IsLogChannel(event->channel)) break;
      headers.push_back(*event);
    }
  }
  for (LogEvent& header : headers) {
    header.utime = start;
    out.Add(header);
  }
}

// The worst of the logs', each told on standard error.
int Report(const std::vector<MappedFile>& logs, const LogMerge& merge, const std::vector<std::int64_t>& events) {
  int exit_code = kExitDone;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const auto damage = merge.damage_of(i);
    const int of_log = LogExitCode(logs[i], events[i], damage);
    if (of_log != kExitBad) std::cerr << DamageText(logs[i].path(), damage);
    if (exit_code != kExitBad && of_log != kExitDone) exit_code = of_log;
  }
  return exit_code;
}

// Writes the events of all logs; how many each had.
std::vector<std::int64_t> Merge(LogMerge& merge, std::size_t logs, std::size_t size, LogOutput& out) {
  std::vector<std::int64_t> events(logs);
  LogProgress progress("merging", size);
  std::size_t done = 0;
  for (; merge.Head() != nullptr && out.problem().empty(); merge.Advance()) {
    ++events[merge.HeadLog()];
    out.Add(*merge.Head());
    progress.At(done += EventSize(*merge.Head()));
  }
  return events;
}

int Run(const Options& options) {
  std::vector<MappedFile> logs;
  std::vector<Bytes> bytes;
  std::size_t size = 0;
  mode_t mode = 0777;
  for (const std::string& file : std::span(options.files).first(options.files.size() - 1)) {
    const MappedFile& log = logs.emplace_back(file);
    if (!log.problem().empty()) {
      std::cerr << log.problem() << '\n';
      return kExitBad;
    }
    bytes.push_back(log.bytes());
    size += log.bytes().size();
    mode &= log.mode();  // none becomes more open than it was
  }
  LogOutput out(options.files.back(), mode);
  AddHeaders(logs, out);
  LogMerge merge(bytes);
  const std::vector<std::int64_t> events = Merge(merge, logs.size(), size, out);
  const int exit_code = Report(logs, merge, events);
  if (exit_code == kExitBad) return exit_code;
  if (const std::string problem = out.Commit(options.force); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitFailed;
  }
  std::cerr << options.files.back() << ": " << out.events() << " events\n";
  return exit_code;
}

}  // namespace

void AddLogMergeCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = log.add_subcommand("merge", "Several logs as one, by time");
  command->add_option("LOG", options->files, "The logs, and last the new one")
      ->required()
      ->expected(2, -1)
      ->type_name("IN... OUT");
  command->add_flag("--force", options->force, "Replaces OUT when it is there already");
  command->footer(std::string("Events of equal times stand in the order of the logs; an event that is in two logs "
                              "stays twice. They are\nnumbered from 0 and sealed anew.\n"
                              "examples:\n"
                              "  axlecast log merge data.log commands.log all.log\n"
                              "  axlecast log merge run.00.log run.01.log run.02.log run.log\n") +
                  kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace axlecast
