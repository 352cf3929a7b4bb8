#pragma once

#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/config/machine_config.h"
#include "platform/os/process.h"
#include "platform/os/run_directory.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/live/format_machine.h"
#include "tools/axlecast/run/process_supervisor.h"
#include "tools/monitor/live_machine.h"

namespace axlecast {

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

}  // namespace axlecast
