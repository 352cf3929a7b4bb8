#include "tools/axlecast/run/machine_run.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <set>
#include <utility>

#include "core/base/table_layout.h"
#include "platform/net/multicast_probe.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/live/format_machine.h"

namespace axlecast {
namespace {

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

}  // namespace

MachineRun::MachineRun(const MachineConfig& machine, std::string file, bool table, bool quiet)
    : machine_(machine), file_(std::move(file)), table_(table), quiet_(quiet) {}

std::string MachineRun::Prepare() {
  if (std::string problem = MissingProgram(machine_); !problem.empty()) return problem;
  for (const std::string& url : {machine_.lcm.url, machine_.lcm.command_url}) {
    const std::string problem = MulticastProblem(url);
    if (!problem.empty())
      return problem + "\nor run in a network namespace of its own: axlecast up --isolated " + file_;
  }
  const std::string directory = RunDirectory(machine_.machine);
  for (const std::string& path : {directory, directory + "/log"}) {
    if (std::string problem = PrepareRunDirectory(path); !problem.empty()) return problem;
  }
  const std::string holder = lock_.Acquire(directory + "/up.lock");
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
    if (const std::string lost = reception_.Next(live_->view().reception(), now, live_->warning()); !lost.empty()) {
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

}  // namespace axlecast
