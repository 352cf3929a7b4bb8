#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <axlecast/recorder_health_t.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <list>
#include <memory>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/messages/json/field.h"
#include "platform/net/lcm_port.h"
#include "platform/os/folder.h"
#include "platform/os/mapped_file.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/logs/record.h"
#include "tools/log/compressed_log.h"
#include "tools/log/log_name.h"
#include "tools/recorder/recording_health.h"
#include "tools/recorder/recording_session.h"

namespace axlecast {
namespace {

// One log of `axlecast record`: the recording, its published health, and its messages for an operator.
struct LogRecording {
  LogRecording(RecordingSettings settings, const Clock& system_clock)
      : name(settings.recorder.identity.name),
        urls(settings.urls),
        clock(system_clock),
        origin(NewOrigin(settings.machine)),
        session(std::move(settings), system_clock) {}

  // Continues the file, if it exists.
  [[nodiscard]] Result<> Continue(const std::string& file) {
    if (access(file.c_str(), F_OK) != 0) return {};  // a new file
    const MappedFile log(file);
    if (!log.problem().empty()) return Failure(log.problem());
    if (IsCompressed(log.bytes()) || file.ends_with(kCompressedEnding)) {
      return Failure(
          file +
          ": is compressed, and cannot be continued; choose another name, or decompress it first: zstd -d '" +
          file + "'");
    }
    const LogTail tail = FindTail(log.bytes());
    if (std::string loss = log.Loss(); !loss.empty()) return Failure(loss);
    if (!log.bytes().empty() && tail.size == 0) {
      return Failure(file + ": contains no LCM event, and is not changed; choose another name");
    }
    if (tail.torn > 0) std::cerr << file << ": removes a torn end of " << tail.torn << " bytes\n";
    session.Append(tail);
    return {};
  }

  // Publishes health and alarms. Appends the errors that have begun or ended since the previous call to `errors`.
  recorder_health_t PublishHealth(LcmPort& port, bool stopping, std::vector<std::string>& errors) {
    const RecordingStatus status = session.status();
    const MonoNs now = clock.Now();
    const std::int64_t utime = clock.UtcMicroseconds();
    recorder_health_t message = health.Make(status, now, utime, stopping);
    static_cast<void>(Publish(port, "RECORDER/" + name, message));
    static_cast<void>(Publish(port, "ALARM/recorder/" + name, alarms.Make(status, now, utime)));
    AddErrors(status.disk, errors);
    return message;
  }

  void AddErrors(const LogWriterStatus& disk, std::vector<std::string>& errors) {
    if (disk.last_error_utime != 0 && disk.last_error != shown_error) {
      errors.push_back(disk.last_error);
      shown_error = disk.last_error;
    } else if (disk.state == DiskState::kGood && disk_failed) {
      errors.push_back(disk.file + ": the disk accepts events again");
      shown_error.clear();
    }
    disk_failed = disk.state != DiskState::kGood;
  }

  std::string name;
  std::vector<std::string> urls;
  const Clock& clock;
  Origin origin;
  RecordingHealth health{name, origin};
  RecordingAlarms alarms{name, origin};
  RecordingSession session;
  std::string shown_error;
  bool disk_failed = false;
};

// Status lines on a terminal, one for each log. Each call draws over the previous lines.
class LiveLines {
 public:
  explicit LiveLines(bool shown) : shown_(shown) {}

  void Draw(const std::string& lines) {
    if (!shown_) return;
    Clear();
    static_cast<void>(WriteOut(lines));
    height_ = std::count(lines.begin(), lines.end(), '\n');
  }
  void Clear() {
    if (!shown_) return;
    const std::string up = height_ > 0 ? "\x1b[" + std::to_string(height_) + 'A' : "";
    static_cast<void>(WriteBytes('\r' + up + "\x1b[J"));
    height_ = 0;
  }

 private:
  bool shown_;
  std::ptrdiff_t height_ = 0;
};

// One run of the command.
class RecordRun {
 public:
  RecordRun(const RecordOptions& options, RecordPlan plan)
      : options_(options),
        live_(!options.json && Screen::Usable()),
        health_port_(plan.logs.front().urls.front(), plan.prefix) {
    for (RecordingSettings& settings : plan.logs) logs_.emplace_back(std::move(settings), clock_);
  }

  int Run() {
    const StopSignal stop;
    if (const Result<> opened = Open(); !opened) return Fail(opened.error().text, kExitFailed);
    for (LogRecording& log : logs_) log.session.Start();
    supervision_.Ready();
    while (!AnyFailed() && !stop.Wait(kRedrawMs)) {
      if (AllHaveProgress()) supervision_.Progress(clock_.Now());
      if (clock_.Now() < next_health_) continue;
      next_health_ = clock_.Now() + kSecond;
      PublishHealth(false);
    }
    supervision_.Stopping();
    PublishHealth(true);
    for (LogRecording& log : logs_) log.session.Stop();
    return End();
  }

 private:
  Result<> Open() {
    if (options_.append) {
      if (Result<> continued = logs_.front().Continue(options_.file); !continued) return continued;
    }
    for (LogRecording& log : logs_) {
      if (Result<> opened = log.session.Open(); !opened) return opened;
    }
    for (const std::string& warning : logs_.front().session.warnings()) std::cerr << "warning: " << warning << '\n';
    for (const LogRecording& log : logs_) Announce(log);
    return {};
  }

  void Announce(const LogRecording& log) const {
    const std::string file = log.session.status().disk.file;
    if (options_.json) {
      static_cast<void>(
          WriteOut(JsonLine({{"kind", "start"}, {"name", log.name}, {"file", file}, {"urls", log.urls}}) + '\n'));
      return;
    }
    std::cerr << Title(log) << (file.empty() ? "waiting for the trigger" : "recording to " + file)
              << "; Ctrl-C ends it\n";
  }

  [[nodiscard]] bool AnyFailed() const {
    return std::any_of(logs_.begin(), logs_.end(),
                       [](const LogRecording& log) { return !log.session.status().failure.empty(); });
  }

  [[nodiscard]] bool AllHaveProgress() {
    return std::all_of(logs_.begin(), logs_.end(), [](LogRecording& log) { return log.session.HasProgress(); });
  }

  void PublishHealth(bool stopping) {
    std::string lines;
    std::vector<std::string> errors;
    for (LogRecording& log : logs_) {
      const recorder_health_t health = log.PublishHealth(health_port_, stopping, errors);
      lines +=
          (lines.empty() ? "" : "\n") + Title(log) + RecordStatusLine(health, log.session.status().disk.closed);
    }
    // All logs receive from the same URLs.
    const std::string network = logs_.front().session.status().receiver.network;
    if (network != shown_network_) {
      errors.push_back("LCM: " + (network.empty() ? "the network can be used again" : network));
      shown_network_ = network;
    }
    if (!errors.empty()) live_.Clear();
    for (const std::string& error : errors) std::cerr << error << '\n';
    live_.Draw(lines);
  }

  // Returns the name of the log, if there are several.
  [[nodiscard]] std::string Title(const LogRecording& log) const { return logs_.size() > 1 ? log.name + ": " : ""; }

  // Reports the result of each log. Returns the greatest exit code.
  int End() {
    live_.Clear();
    int exit_code = kExitDone;
    for (const LogRecording& log : logs_) {
      const RecordingStatus status = log.session.status();
      if (options_.json) {
        static_cast<void>(WriteOut(RecordEndJson(log.name, status) + '\n'));
      } else {
        std::cerr << Title(log) << RecordSummary(status);
      }
      exit_code = std::max(exit_code, RecordExitCode(status));
    }
    return exit_code;
  }

  const RecordOptions& options_;
  LiveLines live_;
  SystemClock clock_;
  Supervision supervision_;
  LcmPort health_port_;
  std::list<LogRecording> logs_;
  std::string shown_network_;
  MonoNs next_health_ = 0;
};

// Creates and locks the folder for the logs of the machine's file.
Result<> LockFolder(const std::string& folder, const std::string& machine, LockFile& lock) {
  if (Result<> links = CheckLinks(folder); !links) return links;
  std::string failed;
  if (const int error = MakeFolders(folder, 0777, failed); error != 0) {
    return Failure(folder + ": cannot be created: " + std::strerror(error) +
                   "; create it, or choose another `directory`");
  }
  const Result<> locked = lock.Acquire(folder + "/." + machine + ".lock");
  if (locked) return {};
  if (access(folder.c_str(), W_OK) != 0) {
    return Failure(folder + ": " + std::strerror(errno) + "; choose a `directory` that this user may write to");
  }
  return Failure(
      locked.error().text +
      ": another recorder already writes the logs of the machine's file; to record a separate log, give a FILE "
      "or a folder (. is the current one)");
}

int RunRecord(const RecordOptions& options) {
  std::optional<MachineConfig> machine;
  if (options.config.Given() || (options.urls.empty() && !options.config.File().empty())) {
    Result<MachineConfig> loaded = options.config.Load();
    if (!loaded) return options.config.Fail(loaded.error());
    machine = *std::move(loaded);
  }
  Result<RecordPlan> plan = MakeRecordPlan(options, machine);
  if (!plan) return Fail(plan.error().text, kExitUsage);
  LockFile lock;
  if (!plan->folder.empty()) {
    if (const Result<> locked = LockFolder(plan->folder, machine->machine, lock); !locked)
      return Fail(locked.error().text, kExitFailed);
  }
  return RecordRun(options, std::move(*plan)).Run();
}

}  // namespace

void AddRecordCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* command = app.add_subcommand("record", "Record the machine's messages into an LCM log");
  options->AddTo(*command);
  command->footer(
      "examples:\n"
      "  axlecast record                                     the logs of the machine's file (recorder:); if it "
      "has\n"
      "                                                      none, all messages into NAME_<time>.lcm here\n"
      "  axlecast record run7.lcm --channel '^POSITION/' --json\n"
      "  axlecast record /var/log/axlecast/ --split-size 100MB --quota 2GB --keep 14d\n"
      "  axlecast record . --trigger 'ALARM/.* battery' --pre-trigger 30s --post-trigger 10s\n"
      "  axlecast record run7.lcm --append\n"
      "Stock tools read the logs: lcm-logplayer run7.lcm. Ctrl-C or SIGTERM writes what has been received, and "
      "ends.\n"
      "exit code: 0 complete, 1 the machine's file is invalid, 2 usage, 3 messages were lost (see the senders), "
      "4 "
      "failed");
  command->callback([options, &exit_code] { exit_code = RunRecord(*options); });
}

}  // namespace axlecast
