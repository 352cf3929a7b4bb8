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
#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/config/hosts.h"
#include "core/config/machine_config.h"
#include "platform/net/group_check.h"
#include "platform/os/folder.h"
#include "platform/os/process.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/config_option.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/subcommands.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_machine.h"
#include "tools/axlecast/run/isolation.h"
#include "tools/axlecast/run/process_supervisor.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {
namespace {

constexpr MonoNs kSimulatorTimeout = 5 * kSecond;  // a driver that starts before its line retries
constexpr MonoNs kLinePeriod = 5 * kSecond;
constexpr std::size_t kEventsShown = 6;

// Fails if a program that the machine needs is missing.
Result<> CheckPrograms(const MachineConfig& machine) {
  std::set<std::string> programs = {CompanionProgram("bridge")};
  for (const BusConfig& bus : machine.buses) programs.insert(DriverProgram(bus.family->name));
  for (const std::string& program : programs) {
    if (access(program.c_str(), X_OK) != 0) {
      return Failure(program + " is missing: build it (ninja axlecast_programs)");
    }
  }
  return {};
}

// Runs a whole machine in the foreground: simulators, bridge and drivers, and shows the content of their messages.
class MachineRun {
 public:
  // `part`: what runs on this host. `file`: the machine's file, for the processes. With `table`, shows a live table; otherwise prints a line to standard
  // error every 5 s, unless `quiet`.
  MachineRun(const MachineConfig& machine, MachineConfig part, std::string host, std::string file, bool table,
             bool quiet)
      : machine_(machine),
        part_(std::move(part)),
        host_(std::move(host)),
        file_(std::move(file)),
        table_(table),
        quiet_(quiet) {}

  // Checks the requirements before anything starts.
  [[nodiscard]] Result<> Prepare() {
    if (Result<> complete = CheckPrograms(part_); !complete) return complete;
    for (const std::string& url : {machine_.lcm.url, machine_.lcm.command_url}) {
      if (const Result<> usable = CheckMulticast(url); !usable) {
        return Failure(usable.error().text + "\nor run in a separate network namespace: axlecast up --isolated " +
                       file_);
      }
    }
    const std::string directory = RunDirectory(machine_.machine);
    for (const std::string& path : {directory, directory + "/log"}) {
      if (Result<> done = PrepareRunDirectory(path); !done) return done;
    }
    if (const Result<> locked = lock_.Acquire(directory + "/up.lock"); !locked) {
      return Failure("machine " + machine_.machine + " is already up (" + locked.error().text +
                     "): end it, or give this file another `machine:` name");
    }
    live_ = std::make_unique<LiveMachine>(machine_, clock_);
    return live_->state();
  }

  // Adds a line below the table.
  void AddNote(std::string line) { notes_.push_back(std::move(line)); }

  // Starts all processes, with `axlecast web` if `web`. Runs until a signal, or for `seconds` (0: no limit). The summary is
  // from the time before the processes are ended, plus how they ended.
  [[nodiscard]] RunSummary Run(double seconds, bool web) {
    const StopSignal stop;
    const MonoNs started = clock_.Now();
    if (table_) screen_ = std::make_unique<Screen>();
    ProcessSupervisor supervisor(RunDirectory(machine_.machine) + "/log", clock_,
                                 [this](const std::string& line) { Report(line); });
    StartAll(supervisor, stop, web);
    const MonoNs end = seconds > 0 ? started + static_cast<MonoNs>(std::llround(seconds * 1e9)) : kNever;
    Follow(supervisor, stop, started, end);
    const MonoNs now = clock_.Now();
    const int requests = stop.Count();
    supervisor.Stop([&] { return stop.Count() > requests + 1; });
    RunSummary summary = Summarize(live_->view(), supervisor.deaths(), now, now - started);
    if (screen_) {
      screen_.reset();
      for (const std::string& event : events_) std::cerr << Printable(event) << '\n';
    }
    return summary;
  }

 private:
  void StartAll(ProcessSupervisor& supervisor, const StopSignal& stop, bool web) {
    using Role = ProcessSupervisor::Role;
    const std::string axlecast = ProgramFolder() + "/axlecast";
    for (const BusConfig& bus : part_.buses) {
      if (!bus.simulate) continue;
      supervisor.Start(Role::kSimulator, "simulator " + bus.name, {axlecast, "simulate", file_, "--bus", bus.name});
    }
    const auto ready = [this] {
      return std::all_of(part_.buses.begin(), part_.buses.end(), [](const BusConfig& bus) {
        return !bus.simulate || access(bus.link.port.c_str(), R_OK | W_OK) == 0;
      });
    };
    const MonoNs give_up = clock_.Now() + kSimulatorTimeout;
    while (!ready() && clock_.Now() < give_up && !stop.Wait(10)) supervisor.Poll();
    if (!part_.recorder.logs.empty()) {
      supervisor.Start(Role::kRecorder, "recorder", {axlecast, "record", "--config", file_, "--json"});
    }
    if (!part_.mqtt.host.empty()) {
      supervisor.Start(Role::kRecorder, "mqtt", {axlecast, "mqtt", "--config", file_, "--json"});
    }
    if (!part_.ship.database.empty()) {
      supervisor.Start(Role::kRecorder, "ship", {axlecast, "ship", "--config", file_, "--json"});
    }
    if (!part_.time.root.empty()) {
      supervisor.Start(Role::kRecorder, "time", {axlecast, "time", "--config", file_, "--host", host_});
    }
    if (!part_.sets.empty()) {
      supervisor.Start(Role::kRecorder, "sets", {axlecast, "sets", "--config", file_});
    }
    if (part_.runs_bridge)
      supervisor.Start(Role::kBridge, "bridge", {CompanionProgram("bridge"), "--config", file_});
    for (const BusConfig& bus : part_.buses) {
      supervisor.Start(Role::kDriver, "driver " + bus.name,
                       {DriverProgram(bus.family->name), "--config", file_, "--bus", bus.name});
    }
    if (web) supervisor.Start(Role::kWeb, "web", {axlecast, "web", "--config", file_});
  }

  void Follow(ProcessSupervisor& supervisor, const StopSignal& stop, MonoNs started, MonoNs end) {
    MonoNs next_show = 0;
    for (MonoNs now = clock_.Now(); !stop.Requested() && now < end; now = clock_.Now()) {
      supervisor.Poll();
      if (now >= next_show) {
        Show(now, started, next_show == 0);
        next_show = now + (screen_ ? kRedrawMs * kMillisecond : kLinePeriod);
      }
      const std::string lost = reception_.NextLine(live_->view().reception(), now, live_->buffer_advice());
      if (!lost.empty()) Report("up: " + lost);
      const MonoNs slice = std::min({end, next_show, now + 50 * kMillisecond});
      if (!live_->Gather(slice, [&stop](const MachineView&) { return stop.Requested(); })) {
        if (!stop.Requested()) Report("the LCM port failed: " + machine_.lcm.url);
        return;
      }
    }
  }

  void Show(MonoNs now, MonoNs started, bool first) {
    if (screen_) {
      std::vector<std::string> lines = RenderTable(live_->view(), now, now - started, events_);
      lines.insert(lines.end(), notes_.begin(), notes_.end());
      screen_->Draw(lines);
    } else if (!quiet_ && !first) {
      std::cerr << RenderLine(live_->view(), now, now - started) << '\n';
    }
  }

  // Prints the line, or shows it with the last events below the table.
  void Report(const std::string& line) {
    if (!screen_) std::cerr << Printable(line) << '\n';
    events_.push_back(line);
    if (events_.size() > kEventsShown) events_.pop_front();
  }

  const MachineConfig& machine_;
  MachineConfig part_;
  std::string host_;
  std::string file_;
  bool table_;
  bool quiet_;
  SystemClock clock_;
  LockFile lock_;
  std::unique_ptr<LiveMachine> live_;
  std::unique_ptr<Screen> screen_;
  std::deque<std::string> events_;  // newest last
  std::vector<std::string> notes_;
  ReceptionReport reception_;
};

struct UpOptions {
  ConfigOption config;
  std::string host;
  double seconds = 0;
  bool isolated = false;
  bool no_table = false;
  bool json = false;
  bool web = false;
};

// Returns the command line of a shell in this process's network.
std::string Entry() { return ShellText(EntryArguments(getpid(), {LoginShell()})); }

int Up(const MachineConfig& machine, const UpOptions& options) {
  const std::string host = ThisHost(options.host);
  Result<MachineConfig> part = PartOn(machine, host);
  if (!part) return Fail(part.error().text, kExitBad);
  if (options.isolated) {
    if (const Result<> entered = EnterIsolation(); !entered) return Fail(entered.error().text, kExitBad);
    std::cerr << "isolated: a shell inside, in which every program reaches the machine (later: axlecast shell "
              << options.config.File() << "):\n  " << Entry() << '\n';
  }
  const bool table = !options.no_table && !options.json && Screen::Usable();
  MachineRun run(machine, std::move(*part), host, options.config.File(), table, options.json);
  if (options.isolated) run.AddNote("isolated; a shell inside: " + Entry());
  if (options.web) {
    const std::string page =
        "page: " + WebUrl(machine.web, HostName()) + (options.isolated ? " (for a browser that gets in)" : "");
    std::cerr << page << '\n';
    run.AddNote(page);
  }
  if (const Result<> prepared = run.Prepare(); !prepared) return Fail(prepared.error().text, kExitBad);
  std::cerr << "logs: " << RunDirectory(machine.machine) << "/log\n";
  const RunSummary summary = run.Run(options.seconds, options.web);
  static_cast<void>(WriteOut(options.json ? summary.json + '\n' : summary.text));
  // Without --seconds, the operator ends the run: that is no error.
  return summary.Good() || options.seconds == 0 ? kExitDone : kExitBad;
}

struct DriverOptions {
  ConfigOption config;
  std::string bus;
};

int RunDriver(const MachineConfig& machine, const DriverOptions& options) {
  const BusConfig* bus = machine.FindBus(options.bus);
  if (bus == nullptr) {
    return Fail("no bus " + Quoted(options.bus) + " in " + machine.file +
                    "\nbuses: " + Listed(MachineNames(machine, false)),
                kExitUsage);
  }
  const std::vector<std::string> program = {DriverProgram(bus->family->name), "--config", options.config.File(),
                                            "--bus", bus->name};
  return Fail(Become(program).text, kExitBad);
}

}  // namespace

void AddUpCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<UpOptions>();
  CLI::App* command = app.add_subcommand(
      "up", "Run the machine, or what belongs to this host: simulators, drivers, bridge, a live table");
  options->config.AddTo(*command, ConfigOption::Form::kPositional);
  command
      ->add_option("--seconds", options->seconds,
                   "End after this time with a summary; exit code 0 only after a good run")
      ->check(CLI::Range(0.1, 1e9))
      ->type_name("N");
  AddHostOption(*command, options->host);
  command->add_flag("--isolated", options->isolated, "Run in a separate network namespace");
  command->add_flag("--no-table", options->no_table, "Print a line every 5 s instead of the live table");
  command->add_flag("--json", options->json, "Print the summary as one JSON object; no table");
  command->add_flag("--web", options->web, "Also serve the page for browsers (axlecast web)");
  command->footer(
      "examples:\n"
      "  axlecast up config/demo.yaml                 live until Ctrl-C\n"
      "  axlecast up config/demo.yaml --web           with its page in the browser\n"
      "  axlecast up config/demo.yaml --seconds 10    no terminal needed\n"
      "  axlecast up config/demo.yaml --isolated      where multicast is not usable\n"
      "  axlecast up machine.yaml --host cell2        the part of host cell2 (hosts: in the file)");
  RunOnMachine<UpOptions>(*command, options, exit_code, &Up);
}

void AddDriverCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DriverOptions>();
  CLI::App* command = app.add_subcommand("driver", "Run the driver of one bus in the foreground");
  command->add_option("BUS", options->bus, "Name of the bus in the machine's file")->required();
  options->config.AddTo(*command, ConfigOption::Form::kOptionOnly);
  command->footer("example: axlecast driver rs485-0 --config machine.yaml");
  RunOnMachine<DriverOptions>(*command, options, exit_code, &RunDriver);
}

}  // namespace axlecast
