#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <deque>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/base/text.h"
#include "core/config/machine_config.h"
#include "platform/net/multicast_port.h"
#include "platform/os/folder.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_machine.h"
#include "tools/axlecast/run/isolation.h"
#include "tools/axlecast/run/process_supervisor.h"
#include "tools/axlecast/run/subcommands.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

// A whole machine in the foreground: simulators, bridge, drivers, and what their messages say.
class MachineRun {
 public:
  // `file` is the machine's file as the processes get it. With `table` a live table, else one line every 5 s
  // on standard error unless `quiet`.
  MachineRun(const MachineConfig& machine, std::string file, bool table, bool quiet);

  // Checks all that must be there before anything starts. Empty when all is, else the cause and the remedy.
  [[nodiscard]] std::string Prepare();

  // A line that stays below the table.
  void AddNote(std::string line) { notes_.push_back(std::move(line)); }

  // `axlecast web` is to run, too.
  void AddWeb() { web_ = true; }

  // Starts all, and runs until a signal asks to stop or `seconds` have passed (0: no end). The summary is of the
  // moment before the processes are ended.
  [[nodiscard]] RunSummary Run(double seconds);

 private:
  void StartAll();
  void AwaitSimulators();
  void Follow(MonoNs end);
  void Show(MonoNs now);
  void Tell(const std::string& line);

  const MachineConfig& machine_;
  std::string file_;
  bool table_;
  bool quiet_;
  bool web_ = false;
  SystemClock clock_;
  LockFile lock_;
  std::unique_ptr<StopSignal> stop_;
  std::unique_ptr<LiveMachine> live_;
  std::unique_ptr<ProcessSupervisor> fleet_;
  std::unique_ptr<Screen> screen_;
  std::deque<std::string> events_;  // newest last
  std::vector<std::string> notes_;
  ReceptionReport reception_;
  MonoNs started_ = 0;
  MonoNs next_show_ = 0;
};

constexpr MonoNs kSimulatorsReady = 5 * kSecond;  // a driver that starts before its line retries by itself
constexpr MonoNs kLinePeriod = 5 * kSecond;
constexpr std::size_t kEventsShown = 6;

bool AnySimulated(const MachineConfig& machine) {
  return std::any_of(machine.buses.begin(), machine.buses.end(), [](const BusConfig& bus) { return bus.simulate; });
}

std::string MissingProgram(const MachineConfig& machine) {
  std::set<std::string> programs = {CompanionProgram("bridge")};
  for (const BusConfig& bus : machine.buses) programs.insert(DriverProgram(bus.family->name));
  for (const std::string& program : programs) {
    if (access(program.c_str(), X_OK) != 0) return program + " is missing: build it (ninja axlecast_programs)";
  }
  return "";
}

MachineRun::MachineRun(const MachineConfig& machine, std::string file, bool table, bool quiet)
    : machine_(machine), file_(std::move(file)), table_(table), quiet_(quiet) {}

std::string MachineRun::Prepare() {
  if (std::string problem = MissingProgram(machine_); !problem.empty()) return problem;
  for (const std::string& url : {machine_.lcm.url, machine_.lcm.command_url}) {
    const std::string problem = ErrorText(CheckMulticast(url));
    if (!problem.empty())
      return problem + "\nor run in a network namespace of its own: axlecast up --isolated " + file_;
  }
  const std::string directory = RunDirectory(machine_.machine);
  for (const std::string& path : {directory, directory + "/log"}) {
    if (const Result<> done = PrepareRunDirectory(path); !done) return done.error().text;
  }
  const std::string holder = ErrorText(lock_.Acquire(directory + "/up.lock"));
  if (!holder.empty()) {
    return "machine " + machine_.machine + " is already up (" + holder +
           "): end that one, or give this file another `machine:` name";
  }
  live_ = std::make_unique<LiveMachine>(machine_, clock_);
  return live_->problem();
}

RunSummary MachineRun::Run(double seconds) {
  stop_ = std::make_unique<StopSignal>();
  started_ = clock_.Now();
  if (table_) screen_ = std::make_unique<Screen>();
  fleet_ = std::make_unique<ProcessSupervisor>(RunDirectory(machine_.machine) + "/log", clock_,
                                               [this](const std::string& line) { Tell(line); });
  StartAll();
  Follow(seconds > 0 ? started_ + static_cast<MonoNs>(std::llround(seconds * 1e9)) : kNever);
  const MonoNs now = clock_.Now();
  const int asked = stop_->Count();
  fleet_->Stop([this, asked] { return stop_->Count() > asked + 1; });
  // As it stood before it was stopped; how the processes ended belongs to it.
  RunSummary summary = Summarize(live_->view(), fleet_->deaths(), now, now - started_);
  if (screen_) {
    screen_.reset();
    for (const std::string& event : events_) std::cerr << Printable(event) << '\n';
  }
  return summary;
}

void MachineRun::StartAll() {
  for (const BusConfig& bus : machine_.buses) {
    if (!bus.simulate) continue;
    fleet_->Start(ProcessSupervisor::Role::kSimulator, "simulator " + bus.name,
                  {ProgramFolder() + "/axlecast", "simulate", file_, "--bus", bus.name});
  }
  if (AnySimulated(machine_)) AwaitSimulators();
  if (!machine_.recorder.logs.empty()) {
    fleet_->Start(ProcessSupervisor::Role::kRecorder, "recorder",
                  {ProgramFolder() + "/axlecast", "record", "--config", file_, "--json"});
  }
  if (!machine_.mqtt.host.empty()) {
    fleet_->Start(ProcessSupervisor::Role::kRecorder, "mqtt",
                  {ProgramFolder() + "/axlecast", "mqtt", "--config", file_, "--json"});
  }
  fleet_->Start(ProcessSupervisor::Role::kBridge, "bridge", {CompanionProgram("bridge"), "--config", file_});
  for (const BusConfig& bus : machine_.buses) {
    fleet_->Start(ProcessSupervisor::Role::kDriver, "driver " + bus.name,
                  {DriverProgram(bus.family->name), "--config", file_, "--bus", bus.name});
  }
  if (web_)
    fleet_->Start(ProcessSupervisor::Role::kWeb, "web", {ProgramFolder() + "/axlecast", "web", "--config", file_});
}

void MachineRun::AwaitSimulators() {
  const MonoNs give_up = clock_.Now() + kSimulatorsReady;
  const auto ready = [this] {
    return std::all_of(machine_.buses.begin(), machine_.buses.end(), [](const BusConfig& bus) {
      return !bus.simulate || access(bus.link.port.c_str(), R_OK | W_OK) == 0;
    });
  };
  while (!ready() && clock_.Now() < give_up && !stop_->Wait(10)) fleet_->Poll();
}

void MachineRun::Follow(MonoNs end) {
  while (!stop_->Requested()) {
    const MonoNs now = clock_.Now();
    if (now >= end) return;
    fleet_->Poll();
    if (now >= next_show_) Show(now);
    if (const std::string lost = reception_.NextLine(live_->view().reception(), now, live_->warning());
        !lost.empty()) {
      Tell("up: " + lost);
    }
    const MonoNs slice = std::min({end, next_show_, now + 50 * kMillisecond});
    if (!live_->Gather(slice, [this](const MachineView&) { return stop_->Requested(); })) {
      if (!stop_->Requested()) Tell("the LCM port failed: " + machine_.lcm.url);
      return;
    }
  }
}

void MachineRun::Show(MonoNs now) {
  if (screen_) {
    std::vector<std::string> lines = RenderTable(live_->view(), now, now - started_, events_);
    lines.insert(lines.end(), notes_.begin(), notes_.end());
    screen_->Draw(lines);
    next_show_ = now + kRedrawMs * kMillisecond;
    return;
  }
  if (!quiet_ && next_show_ != 0) std::cerr << RenderLine(live_->view(), now, now - started_) << '\n';
  next_show_ = now + kLinePeriod;
}

void MachineRun::Tell(const std::string& line) {
  if (!screen_) std::cerr << Printable(line) << '\n';
  events_.push_back(line);
  if (events_.size() > kEventsShown) events_.pop_front();
}

struct UpOptions {
  ConfigOption config;
  double seconds = 0;
  bool isolated = false;
  bool no_table = false;
  bool json = false;
  bool web = false;
};

// The line that gives a shell in this process's network.
std::string Entry() { return ShellText(EntryArguments(getpid(), {LoginShell()})); }

int Up(const UpOptions& options) {
  const auto machine = options.config.Load();
  if (!machine) return options.config.Fail(machine.error());
  if (options.isolated) {
    if (const std::string problem = EnterIsolation(); !problem.empty()) {
      std::cerr << problem << '\n';
      return kExitBad;
    }
    std::cerr << "isolated: a shell inside, in which every program reaches the machine (later: axlecast shell "
              << options.config.File() << "):\n  " << Entry() << '\n';
  }
  const bool table = !options.no_table && !options.json && Screen::Usable();
  MachineRun run(*machine, options.config.File(), table, options.json);
  if (options.isolated) run.AddNote("isolated; a shell inside: " + Entry());
  if (options.web) {
    const std::string page =
        "page: " + WebUrl(machine->web, HostName()) + (options.isolated ? " (for a browser that gets in)" : "");
    std::cerr << page << '\n';
    run.AddNote(page);
    run.AddWeb();
  }
  if (const std::string problem = run.Prepare(); !problem.empty()) {
    std::cerr << problem << '\n';
    return kExitBad;
  }
  std::cerr << "logs: " << RunDirectory(machine->machine) << "/log\n";
  const RunSummary summary = run.Run(options.seconds);
  static_cast<void>(WriteOut(options.json ? summary.json + '\n' : summary.text));
  // Without an end of its own the run ends when the operator wants it to: that is no fault.
  return summary.Good() || options.seconds == 0 ? kExitDone : kExitBad;
}

}  // namespace

void AddUpCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<UpOptions>();
  CLI::App* command = app.add_subcommand("up", "Runs the whole machine: simulators, drivers, bridge, a live table");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command
      ->add_option("--seconds", options->seconds,
                   "End after so long with a summary; exit code 0 only after a good run")
      ->check(CLI::Range(0.1, 1e9))
      ->type_name("N");
  command->add_flag("--isolated", options->isolated, "In a network namespace of its own");
  command->add_flag("--no-table", options->no_table, "A line every 5 s instead of the live table");
  command->add_flag("--json", options->json, "The summary as one JSON object; no table");
  command->add_flag("--web", options->web, "With its page for browsers (axlecast web)");
  command->footer(
      "examples:\n"
      "  axlecast up config/demo.yaml                 live until Ctrl-C\n"
      "  axlecast up config/demo.yaml --web           with its page in the browser\n"
      "  axlecast up config/demo.yaml --seconds 10    no terminal needed\n"
      "  axlecast up config/demo.yaml --isolated      where multicast is not usable");
  command->callback([options, &exit_code] { exit_code = Up(*options); });
}

}  // namespace axlecast
