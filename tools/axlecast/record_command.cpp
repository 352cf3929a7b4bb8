#include "tools/axlecast/record_command.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <utility>

#include "drivers/io/lcm_port.h"
#include "drivers/io/mapped_file.h"
#include "drivers/io/process.h"
#include "drivers/io/system_clock.h"
#include "tools/axlecast/exit_code.h"
#include "tools/axlecast/record_options.h"
#include "tools/axlecast/record_report.h"
#include "tools/axlecast/screen.h"
#include "tools/log/log_tail.h"
#include "tools/recorder/recording_health.h"

namespace axlecast {
namespace {

constexpr const char* kLineStart = "\r\x1b[K";

// One run of the command.
class RecordRun {
 public:
  RecordRun(const RecordOptions& options, RecordPlan plan)
      : options_(options),
        name_(plan.settings.recorder.identity.name),
        urls_(plan.settings.urls),
        live_(!options.json && Screen::Usable()),
        health_port_(urls_.front(), std::move(plan.prefix)),
        health_(name_, RandomBootId()),
        recording_(std::move(plan.settings), clock_) {}

  int Run() {
    const StopSignal stop;
    std::string problem = options_.append ? Continue() : "";
    if (problem.empty()) problem = recording_.Open();
    if (!problem.empty()) {
      std::cerr << problem << '\n';
      return kExitFailed;
    }
    for (const std::string& warning : recording_.warnings()) std::cerr << "warning: " << warning << '\n';
    Announce();
    recording_.Start();
    while (!recording_.failed() && !stop.Wait(kRedrawMs)) Tell();
    PublishHealth(true);
    recording_.Stop();
    return End();
  }

 private:
  // Goes on with the file. Empty, or why that cannot be.
  std::string Continue() {
    if (access(options_.file.c_str(), F_OK) != 0) return "";  // it begins a new one
    const MappedFile file(options_.file);
    if (!file.problem().empty()) return file.problem();
    const LogTail tail = FindTail(file.bytes());
    if (std::string loss = file.Loss(); !loss.empty()) return loss;
    if (!file.bytes().empty() && tail.size == 0) {
      return options_.file + ": holds no event of LCM, and is left as it is; choose another name";
    }
    if (tail.torn > 0) std::cerr << options_.file << ": cuts off a torn end of " << tail.torn << " bytes\n";
    recording_.Append(tail);
    return "";
  }

  void Announce() const {
    if (options_.json) {
      static_cast<void>(WriteOut(RecordStartJson(recording_.status(), urls_) + '\n'));
      return;
    }
    const std::string file = recording_.status().disk.file;
    std::cerr << (file.empty() ? "waiting for the trigger" : "recording to " + file) << "; Ctrl-C ends it\n";
  }

  void Tell() {
    const MonoNs now = clock_.Now();
    if (now < next_health_) return;
    next_health_ = now + kSecond;
    PublishHealth(false);
  }

  void PublishHealth(bool stopping) {
    const RecordingStatus status = recording_.status();
    const recorder_health_t health = health_.Make(status, clock_.Now(), clock_.UtcMicroseconds(), stopping);
    static_cast<void>(Publish(health_port_, "RECORDER/" + name_, health));
    TellError(status.disk);
    if (live_) static_cast<void>(WriteOut(kLineStart + RecordStatusLine(health)));
  }

  // Once, when it appears and when it is over.
  void TellError(const LogWriterStatus& disk) {
    if (disk.last_error_utime != 0 && disk.last_error != told_) {
      std::cerr << (live_ ? kLineStart : "") << disk.last_error << '\n';
      told_ = disk.last_error;
    } else if (disk.state == DiskState::kGood && bad_) {
      std::cerr << (live_ ? kLineStart : "") << "the disk takes events again\n";
      told_.clear();
    }
    bad_ = disk.state != DiskState::kGood;
  }

  int End() {
    const RecordingStatus status = recording_.status();
    if (live_) static_cast<void>(WriteOut(kLineStart));
    if (options_.json) {
      static_cast<void>(WriteOut(RecordEndJson(status) + '\n'));
    } else {
      std::cerr << RecordSummary(status);
    }
    return RecordExitCode(status);
  }

  const RecordOptions& options_;
  std::string name_;
  std::vector<std::string> urls_;
  bool live_;
  SystemClock clock_;
  LcmPort health_port_;
  RecordingHealth health_;
  Recording recording_;
  MonoNs next_health_ = 0;
  std::string told_;
  bool bad_ = false;
};

int RunRecord(const RecordOptions& options) {
  std::optional<MachineConfig> machine;
  if (options.config.Given() || (options.urls.empty() && !options.config.File().empty())) {
    int exit_code = kExitDone;
    machine = options.config.Load(exit_code);
    if (!machine) return exit_code;
  }
  RecordPlan plan = MakeRecordPlan(options, machine);
  if (!plan.problem.empty()) {
    std::cerr << plan.problem << '\n';
    return kExitUsage;
  }
  return RecordRun(options, std::move(plan)).Run();
}

}  // namespace

void AddRecordCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* command = app.add_subcommand("record", "Records the machine's messages into an LCM log");
  options->AddTo(*command);
  command->footer(
      "examples:\n"
      "  axlecast record                                     everything, both ports, NAME_<time>.lcm here\n"
      "  axlecast record run7.lcm --channel '^POSITION/' --json\n"
      "  axlecast record /var/log/axlecast/ --split-size 100MB --quota 2GB\n"
      "  axlecast record --trigger 'ALARM/.* battery' --pre-trigger 30s --post-trigger 10s\n"
      "  axlecast record run7.lcm --append\n"
      "Stock tools read the logs: lcm-logplayer run7.lcm. Ctrl-C or SIGTERM writes what has come, and ends.\n"
      "exit code: 0 whole, 1 the machine's file is bad, 2 usage, 3 something was lost (told by sender), 4 failed");
  command->callback([options, &exit_code] { exit_code = RunRecord(*options); });
}

}  // namespace axlecast
