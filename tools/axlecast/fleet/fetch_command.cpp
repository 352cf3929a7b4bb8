#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/spelling.h"
#include "core/base/utc_text.h"
#include "platform/os/new_file.h"
#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/fleet/fleet_connection.h"
#include "tools/axlecast/fleet/fleet_times.h"
#include "tools/axlecast/logs/log_output.h"
#include "tools/fleet/read/fleet_reader.h"
#include "tools/fleet/read/raw_query.h"
#include "tools/fleet/read/recorded_log.h"
#include "tools/log/channel_filter.h"
#include "tools/log/log_name.h"
#include "tools/recorder/log_composer.h"

namespace axlecast {
namespace {

constexpr mode_t kLogMode = 0640;

struct FetchOptions {
  FleetConnection database;
  FleetTimeOptions time;
  std::string machine;
  std::string log;
  std::string channel;
  std::string output;
  bool invert = false;
  bool force = false;
};

// The logs of one recorder of the machine.
using Recorder = std::vector<FleetLog>;

// What was written, and what is missing in it.
struct FetchReport {
  std::int64_t events = 0;
  std::int64_t files = 0;
  std::int64_t whole = 0;  // files of which the database has every message
  std::vector<DamagedRaw> damaged;
  ChannelLosses losses;  // by the numbers of the messages

  void Add(const LogEvent& event) {
    ++events;
    losses.On(event);
  }
  void Add(const std::vector<DamagedRaw>& more) { damaged.insert(damaged.end(), more.begin(), more.end()); }
};

// Fetches the raw records of a machine into logs.
class Fetch {
 public:
  Fetch(FleetReader& reader, FleetMachine machine, const FetchOptions& options, const QueryTimes& times,
        const StopSignal& stop)
      : reader_(reader), machine_(std::move(machine)), options_(options), times_(times), stop_(stop) {}

  [[nodiscard]] Result<> Prepare();
  // Writes one file. Its events are merged by their times if there are several recorders.
  [[nodiscard]] Result<> ToFile();
  // Writes one file per log.
  [[nodiscard]] Result<> ToFolder();

  [[nodiscard]] const FetchReport& report() const { return report_; }
  // Returns one line for each thing that is missing in the selected range.
  [[nodiscard]] Result<std::vector<std::string>> Missing();

 private:
  [[nodiscard]] bool Selects(const FleetLog& log) const;
  [[nodiscard]] Result<FetchedHead> Head(const FleetLog& log);
  // Writes one log, with its recorded numbers if the database has every record of it.
  [[nodiscard]] Result<> WriteLog(const FleetLog& log, const std::string& path);
  [[nodiscard]] Result<> WriteWhole(const FleetLog& log, const std::string& path);
  [[nodiscard]] Result<> WriteMerged(const std::vector<Recorder>& recorders, const std::string& path);
  [[nodiscard]] bool SelectsAll() const {
    return options_.channel.empty() && !options_.invert && !times_.from && !times_.until;
  }

  FleetReader& reader_;
  FleetMachine machine_;
  const FetchOptions& options_;
  QueryTimes times_;
  const StopSignal& stop_;
  ChannelFilter filter_;
  std::vector<Recorder> recorders_;
  FetchReport report_;
};

bool Fetch::Selects(const FleetLog& log) const {
  constexpr std::int64_t kSlack = 3'600'000'000;  // us, between the times of messages and of their reception
  if (times_.from && log.last_utime != 0 && log.last_utime < *times_.from - kSlack) return false;
  if (times_.until && log.first_utime != 0 && log.first_utime > *times_.until + kSlack) return false;
  return options_.log.empty() || log.name == options_.log || PlainLogName(log.file) == PlainLogName(options_.log);
}

Result<> Fetch::Prepare() {
  if (const Result<> set = filter_.Set(options_.channel, options_.invert); !set)
    return Failure("--channel: " + set.error().text);
  const auto logs = reader_.Logs(machine_);
  if (!logs) return Failure(logs.error());
  std::map<std::pair<std::string, std::string>, Recorder> recorders;
  std::set<std::string> names;
  for (const FleetLog& log : *logs) {
    names.insert(log.name);
    if (Selects(log)) recorders[{log.name, log.host}].push_back(log);
  }
  for (auto& [name, recorder] : recorders) recorders_.push_back(std::move(recorder));
  if (!recorders_.empty()) return {};
  if (options_.log.empty())
    return Failure("the database has no log of machine " + machine_.name + " within these times");
  const std::vector<std::string> known(names.begin(), names.end());
  return Failure("the database has no log " + Quoted(options_.log) + " of machine " + machine_.name +
                 " within these times" +
                 Suggestion(options_.log, known, known.empty() ? "" : ": it has " + Listed(known)));
}

Result<FetchedHead> Fetch::Head(const FleetLog& log) {
  auto machine_file = ReadMachineFile(reader_, log);
  if (!machine_file) return Failure(machine_file.error());
  return HeadOf(log, *std::move(machine_file));
}

Result<> Fetch::ToFile() {
  if (recorders_.size() == 1 && recorders_.front().size() == 1)
    return WriteLog(recorders_.front().front(), options_.output);
  return WriteMerged(recorders_, options_.output);
}

Result<> Fetch::ToFolder() {
  std::error_code error;
  std::filesystem::create_directories(options_.output, error);
  if (error) return Failure(options_.output + ": " + error.message());
  std::set<std::string> used;
  for (const Recorder& recorder : recorders_) {
    for (const FleetLog& log : recorder) {
      const std::string name = IsName(log.name) ? log.name : "log";  // the database could contain any text
      std::string file = std::filesystem::path(PlainLogName(log.file)).filename().string();
      if (LogFilePrefix(file).empty()) file = LogFileName(name, log.start_utime, 0);
      for (int copy = 1; !used.insert(file).second; ++copy) file = LogFileName(name, log.start_utime, copy);
      if (Result<> written = WriteLog(log, options_.output + '/' + file); !written) return written;
    }
  }
  return {};
}

Result<> Fetch::WriteLog(const FleetLog& log, const std::string& path) {
  if (SelectsAll()) {
    const auto coverage = ReadCoverage(reader_, log);
    if (!coverage) return Failure(coverage.error());
    if (coverage->IsWhole(log.upto)) return WriteWhole(log, path);
  }
  return WriteMerged({{log}}, path);
}

Result<> Fetch::WriteWhole(const FleetLog& log, const std::string& path) {
  const auto head = Head(log);
  if (!head) return Failure(head.error());
  NewFile file(path, {.mode = kLogMode});
  RecordedLogEncoder encoder([&](Bytes record) { return file.Collect(AsText(record)); });
  encoder.AddHeader(head->utime, kRecorderChannel, head->recorder);
  encoder.AddHeader(head->utime, kMachineChannel, head->machine);
  encoder.AddHeader(head->utime, kSchemaChannel, SchemaText());
  RawLane lane(reader_, {log}, times_);
  for (;;) {
    if (Result<> advanced = lane.Advance(); !advanced) return advanced;
    if (lane.head() == nullptr || !encoder.good()) break;
    if (stop_.Requested()) return Failure("interrupted: nothing was written");
    encoder.Add(*lane.head());
    report_.Add(*lane.head());
  }
  report_.Add(lane.damaged());
  static_cast<void>(encoder.End());
  ++report_.files;
  ++report_.whole;
  return file.Commit(options_.force);
}

Result<> Fetch::WriteMerged(const std::vector<Recorder>& recorders, const std::string& path) {
  LogOutput out(path, kLogMode);
  std::vector<RawLane> lanes;
  lanes.reserve(recorders.size());  // their events refer to them
  for (const Recorder& recorder : recorders) {
    for (const FleetLog& log : recorder) {
      const auto head = Head(log);
      if (!head) return Failure(head.error());
      out.Add({.utime = head->utime, .channel = kRecorderChannel, .data = AsBytes(head->recorder)});
      out.Add({.utime = head->utime, .channel = kMachineChannel, .data = AsBytes(head->machine)});
      out.Add({.utime = head->utime, .channel = kSchemaChannel, .data = AsBytes(SchemaText())});
    }
    lanes.emplace_back(reader_, recorder, times_);
    if (Result<> advanced = lanes.back().Advance(); !advanced) return advanced;
  }
  const std::int64_t before = report_.events;
  while (out.good()) {
    RawLane* next = nullptr;
    for (RawLane& lane : lanes) {
      if (lane.head() != nullptr && (next == nullptr || lane.head()->utime < next->head()->utime)) next = &lane;
    }
    if (next == nullptr) break;
    if (stop_.Requested()) return Failure("interrupted: nothing was written");
    if (filter_.Matches(next->head()->channel)) {
      out.Add(*next->head());
      report_.Add(*next->head());
    }
    if (Result<> advanced = next->Advance(); !advanced) return advanced;
  }
  for (const RawLane& lane : lanes) report_.Add(lane.damaged());
  if (out.good() && report_.events == before) return {};  // no file: without a message it would be of no use
  ++report_.files;
  return out.Commit(options_.force);
}

Result<std::vector<std::string>> Fetch::Missing() {
  std::vector<std::string> lines;
  for (const DamagedRaw& row : report_.damaged) {
    lines.push_back(row.log + ": " + std::to_string(row.n) + " events from number " +
                    std::to_string(row.first_event) + " on are missing (" + UtcText(row.t0) + " to " +
                    UtcText(row.t1) + "): " + row.why);
  }
  for (const ChannelLoss& loss : report_.losses.losses()) {
    lines.push_back(
        loss.channel + ": " + std::to_string(loss.lost) +
        " messages are missing by their numbers: they were not recorded, or their channel is not raw all the time");
  }
  const auto holes = reader_.database().Query(
      "SELECT cause, t0, t1, messages FROM axlecast.hole WHERE machine = $1 AND coalesce(t1, t0, noticed) >= $2"
      " AND coalesce(t0, t1, noticed) < $3 ORDER BY t0 LIMIT 1000",
      {db::Parameter::Int(machine_.id), db::Parameter::Timestamp(times_.from.value_or(INT64_MIN)),
       db::Parameter::Timestamp(times_.until.value_or(INT64_MAX))});
  if (!holes) return Failure(holes.error());
  for (int row = 0; row < holes->size(); ++row) {
    const auto time = [&](int column) {
      const auto utime = holes->Timestamp(row, column);
      return utime ? UtcText(*utime) : std::string("?");
    };
    lines.push_back("hole from " + time(1) + " to " + time(2) + ": " + std::string(holes->Text(row, 0)));
  }
  if (report_.files > 0 && report_.whole == report_.files) return lines;
  const auto kept = reader_.database().Query(
      "SELECT now() - keep FROM axlecast.retention WHERE kind = 'raw' AND keep IS NOT NULL");
  if (!kept) return Failure(kept.error());
  if (const auto oldest = kept->Timestamp(0, 0); oldest) {
    std::int64_t first = INT64_MAX;
    for (const Recorder& recorder : recorders_) {
      if (recorder.front().first_utime != 0) first = std::min(first, recorder.front().first_utime);
    }
    if (std::max(first, times_.from.value_or(INT64_MIN)) < *oldest && (!times_.until || first < *times_.until)) {
      lines.push_back("raw records before " + UtcText(*oldest) + " may be deleted: `axlecast fleet retention raw`");
    }
  }
  return lines;
}

bool IsFolder(const std::string& path) {
  std::error_code error;
  return path.ends_with('/') || std::filesystem::is_directory(path, error);
}

int Report(Fetch& fetch, const FleetReader& reader, const FetchOptions& options) {
  const auto missing = fetch.Missing();
  if (!missing) return FailReader(reader, missing.error());
  for (const std::string& line : *missing) std::cerr << line << '\n';
  const FetchReport& report = fetch.report();
  if (report.events == 0) {
    return Fail(
        "the database has no raw records of this selection: `raw: true` in ship.detail of the machine's file "
        "stores them",
        kExitLosses);
  }
  std::cerr << options.output << ": " << report.events << " events in " << report.files
            << (report.files == 1 ? " log\n" : " logs\n");
  return missing->empty() ? kExitDone : kExitLosses;
}

int RunFetch(FetchOptions& options) {
  auto settings = options.database.Settings(false);
  if (!settings) return Fail(settings.error().text, kExitUsage);
  const auto name = options.database.MachineName(options.machine);
  if (!name) return Fail(name.error().text, kExitUsage);
  const StopSignal stop;
  settings->stop = stop.FileDescriptor();
  SecretFiles secrets;
  FleetReader reader(*settings, secrets);
  const auto machine = reader.OpenMachine(*name);
  if (!machine) return FailReader(reader, machine.error());
  const auto times = options.time.Parse(reader, *machine);
  if (!times) return Fail(times.error().text, kExitUsage);
  Fetch fetch(reader, *machine, options, *times, stop);
  if (const Result<> prepared = fetch.Prepare(); !prepared) return Fail(prepared.error().text, kExitBad);
  const Result<> written = IsFolder(options.output) ? fetch.ToFolder() : fetch.ToFile();
  if (!written) return Fail(written.error().text, kExitFailed);
  return Report(fetch, reader, options);
}

}  // namespace

void AddFleetFetchCommand(CLI::App& fleet, int& exit_code) {
  auto options = std::make_shared<FetchOptions>();
  CLI::App* command = fleet.add_subcommand("fetch", "Write a machine's raw messages from the database to a log");
  command->add_option("OUTPUT", options->output, "The new log, or a folder for one log per recorded log")
      ->required();
  command->add_option("--machine", options->machine, "The machine; without it, that of the machine's file")
      ->type_name("NAME");
  command->add_option("--log", options->log, "Fetch only this log: a name within recorder.logs, or a file")
      ->type_name("NAME");
  command->add_option("--channel", options->channel, "Fetch only channels that match REGEX")->type_name("REGEX");
  command->add_flag("--invert", options->invert, "Fetch only channels that do not match");
  options->time.AddTo(*command);
  command->add_flag("--force", options->force, "Replace OUTPUT if it exists");
  options->database.AddTo(*command);
  command->footer(
      std::string(
          "The database has the raw messages of the channels with `raw: true` in ship.detail. axlecast replay "
          "plays the "
          "log, and\n"
          "axlecast redecode judges it. If every message of a log was shipped raw and all of it is fetched, the "
          "events keep their\n"
          "numbers. Otherwise they are numbered from 0. In one file, the events of several logs are merged by "
          "their times.\n"
          "examples:\n"
          "  axlecast fleet fetch --machine press3 --log positions --from -10m last.lcm\n"
          "  axlecast fleet fetch --machine press3 --channel '^WIRE/' --from 2026-11-21T07:00 --until "
          "2026-11-21T07:05 wire.lcm\n"
          "  axlecast fleet fetch --machine press3 --log press3-all_20261121T070000Z.lcm fetched/\n") +
      kConnectionHelp +
      "Exit code: 0 complete, 3 something in the selection is missing, 6 no server answers, 1 no such machine, 2 "
      "usage,\n"
      "4 the log could not be written.\n");
  command->callback([options, &exit_code] { exit_code = RunFetch(*options); });
}

}  // namespace axlecast
