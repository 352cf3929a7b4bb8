#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "core/base/result.h"
#include "platform/os/new_file.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/log_input.h"
#include "tools/axlecast/logs/log_output.h"
#include "tools/log/log_event.h"
#include "tools/log/log_merge.h"

namespace axlecast {
namespace {

struct LogFilterOptions {
  std::string in;
  std::string out;
  LogFilter filter;
  bool force = false;
};

int RunLogFilter(LogFilterOptions& options) {
  LogInput input;
  if (!input.Open(options.in)) return kExitBad;
  if (const Result<> parsed = options.filter.Parse(input.log()); !parsed)
    return Fail(parsed.error().text, kExitUsage);
  LogOutput out(options.out, input.file().mode());
  input.Read("filtering", [&](const LogEvent& event, std::size_t) {
    if (IsLogChannel(event.channel) || options.filter.Matches(event)) out.Add(event);
    return out.good();
  });
  const int exit_code = input.ExitCode();
  if (exit_code == kExitBad) return exit_code;
  if (const Result<> committed = out.Commit(options.force); !committed)
    return Fail(committed.error().text, kExitFailed);
  std::cerr << DamageText(options.in, input.damage()) << options.out << ": " << out.events() << " of "
            << input.events() << " events\n";
  return exit_code;
}

struct LogMergeOptions {
  std::vector<std::string> files;  // the last one is the output
  bool force = false;
};

// Adds the header events of all logs, with the time of the first event of the merged log.
void AddHeaders(const std::vector<Bytes>& logs, LogOutput& out) {
  std::vector<LogEvent> headers;
  std::int64_t start = INT64_MAX;
  for (const Bytes log : logs) {
    LogReader reader(log);
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

// Prints the damage of each log. Returns the greatest exit code.
int ReportMerge(const std::vector<OpenedLog>& logs, const LogMerge& merge,
                const std::vector<std::int64_t>& events) {
  int exit_code = kExitDone;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const auto damage = merge.damage_of(i);
    const int of_log = LogExitCode(logs[i], events[i], damage);
    if (of_log != kExitBad) std::cerr << DamageText(logs[i].path(), damage);
    if (exit_code != kExitBad && of_log != kExitDone) exit_code = of_log;
  }
  return exit_code;
}

// Writes the events of all logs. Returns the number of events of each log.
std::vector<std::int64_t> Merge(LogMerge& merge, std::size_t logs, std::size_t size, LogOutput& out) {
  std::vector<std::int64_t> events(logs);
  LogProgress progress("merging", size);
  std::size_t done = 0;
  for (; merge.Head() != nullptr && out.good(); merge.Advance()) {
    ++events[merge.HeadLog()];
    out.Add(*merge.Head());
    progress.At(done += EventSize(*merge.Head()));
  }
  return events;
}

int RunLogMerge(const LogMergeOptions& options) {
  LogFiles logs;
  if (const Result<> opened = logs.Open(std::span(options.files).first(options.files.size() - 1)); !opened)
    return Fail(opened.error().text, kExitBad);
  std::size_t size = 0;
  mode_t mode = 0777;
  for (const OpenedLog& log : logs.files()) {
    size += log.bytes().size();
    mode &= log.mode();  // the result is readable only by those who may read all logs
  }
  LogOutput out(options.files.back(), mode);
  AddHeaders(logs.bytes(), out);
  LogMerge merge(logs.bytes());
  const std::vector<std::int64_t> events = Merge(merge, logs.files().size(), size, out);
  const int exit_code = ReportMerge(logs.files(), merge, events);
  if (exit_code == kExitBad) return exit_code;
  if (const Result<> committed = out.Commit(options.force); !committed)
    return Fail(committed.error().text, kExitFailed);
  std::cerr << options.files.back() << ": " << out.events() << " events\n";
  return exit_code;
}

struct LogRepairOptions {
  std::string file;
  std::string output;
  bool force = false;
};

// Returns a free name for the damaged log: LOG.damaged, else LOG.damaged.2, ...
std::string KeptName(const std::string& file) {
  std::string name = file + ".damaged";
  for (int i = 2; std::filesystem::exists(std::filesystem::symlink_status(name)); ++i) {
    name = file + ".damaged." + std::to_string(i);
  }
  return name;
}

// Copies the data between the damaged regions unchanged. Numbers and seals are kept, so that missing events can be detected.
Result<> WriteUndamaged(NewFile& out, Bytes log, const std::vector<LogReader::Damage>& damage) {
  constexpr std::size_t kPiece = 8U << 20;  // bytes between two updates of the progress
  LogProgress progress("writing", log.size());
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= damage.size(); ++i) {
    const std::size_t end = i < damage.size() ? damage[i].offset : log.size();
    while (begin < end) {
      const Bytes piece = log.subspan(begin, std::min(end - begin, kPiece));
      if (Result<> appended = out.Append(AsText(piece)); !appended) return appended;
      progress.At(begin += piece.size());
    }
    if (i < damage.size()) begin = end + damage[i].size;
  }
  return {};
}

// Returns an error if the file has changed since it was read.
Result<> CheckUnchanged(const OpenedLog& file) {
  if (std::string loss = file.Loss(); !loss.empty()) return Failure(loss);
  std::error_code error;
  const auto size = std::filesystem::file_size(file.path(), error);
  if (size != file.file_bytes() || error)
    return Failure(file.path() + " is being written: stop its recorder first");
  return {};
}

int RunLogRepair(const LogRepairOptions& options) {
  LogInput input;
  if (!input.Open(options.file)) return kExitBad;
  const OpenedLog& file = input.file();
  const Bytes log = input.log();
  input.Read("reading", [](const LogEvent&, std::size_t) { return true; });
  const int exit_code = input.ExitCode();
  if (exit_code == kExitBad) return exit_code;
  if (!file.Loss().empty()) return kExitFailed;
  const bool in_place = options.output.empty();
  if (exit_code == kExitDone && in_place) {
    std::cout << options.file << ": " << input.events() << " events, nothing to repair\n";
    return kExitDone;
  }
  if (in_place && file.compressed()) {
    return Fail(file.path() + " is compressed, and not repaired in place: give the repaired log a name by --output",
                kExitUsage);
  }
  NewFile out(in_place ? options.file : options.output, in_place ? file.access() : FileAccess{.mode = file.mode()});
  const Result<> written = WriteUndamaged(out, log, input.damage());
  const std::string kept = in_place ? KeptName(options.file) : "";
  if (const Result<> unchanged = CheckUnchanged(file); !unchanged) return Fail(unchanged.error().text, kExitFailed);
  if (!written) return Fail(written.error().text, kExitFailed);
  if (const Result<> committed = out.Commit(in_place || options.force, kept); !committed)
    return Fail(committed.error().text, kExitFailed);
  std::cout << DamageText(options.file, input.damage()) << (in_place ? options.file : options.output) << ": "
            << input.events() << " events; " << DamagedBytes(input.damage()) << " damaged bytes left out"
            << (in_place ? "; original: " + kept : "") << '\n';
  return exit_code;
}

}  // namespace

void AddLogFilterCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogFilterOptions>();
  CLI::App* command = log.add_subcommand("filter", "Write selected events of a log to a new log");
  command->add_option("IN", options->in, "The log")->required();
  command->add_option("OUT", options->out, "The new log")->required();
  options->filter.AddTo(*command);
  command->add_flag("--force", options->force, "Replace OUT if it exists");
  command->footer(std::string("The header events of the log (machine's file, message types) are kept. Events are "
                              "numbered from 0 and sealed\n"
                              "again.\n"
                              "examples:\n"
                              "  axlecast log filter run.log axis1.log --channel '/axis1$'\n"
                              "  axlecast log filter run.log quiet.log --channel '^(POSITION|WIRE)' --invert\n"
                              "  axlecast log filter run.log minute.log --from 5m --until 6m\n") +
                  kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = RunLogFilter(*options); });
}

void AddLogMergeCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogMergeOptions>();
  CLI::App* command = log.add_subcommand("merge", "Merge several logs into one, ordered by time");
  command->add_option("LOG", options->files, "The logs, and the new log as the last one")
      ->required()
      ->expected(2, -1)
      ->type_name("IN... OUT");
  command->add_flag("--force", options->force, "Replace OUT if it exists");
  command->footer(std::string("Events with equal times are in the order of the logs. An event that two logs "
                              "contain appears twice. Events are\n"
                              "numbered from 0 and sealed again.\n"
                              "examples:\n"
                              "  axlecast log merge data.log commands.log all.log\n"
                              "  axlecast log merge run.00.log run.01.log run.02.log run.log\n") +
                  kLogExitCodes);
  command->callback([options, &exit_code] { exit_code = RunLogMerge(*options); });
}

void AddLogRepairCommand(CLI::App& log, int& exit_code) {
  auto options = std::make_shared<LogRepairOptions>();
  CLI::App* command =
      log.add_subcommand("repair", "Remove damaged bytes from a log, so that every reader can read it");
  command->add_option("LOG", options->file, "The log")->required();
  CLI::Option* output =
      command->add_option("--output", options->output, "Write the repaired log to FILE, and do not change LOG")
          ->type_name("FILE");
  command->add_flag("--force", options->force, "Replace FILE if it exists")->needs(output);
  command->footer(std::string(
      "Without --output, the repaired log replaces LOG in one step, and the damaged log is kept as LOG.damaged. If "
      "there\n"
      "is no damage, nothing is changed. Events keep their numbers and seals, so `axlecast log verify` still "
      "reports\n"
      "missing events.\n"
      "examples:\n"
      "  axlecast log repair run.log\n"
      "  axlecast log repair run.log --output whole.log\n"
      "Exit code: 0 no damage, 3 repaired, damaged bytes were removed, 1 not a log or not readable, 2 usage,\n"
      "4 the repaired log could not be written.\n"));
  command->callback([options, &exit_code] { exit_code = RunLogRepair(*options); });
}

}  // namespace axlecast
