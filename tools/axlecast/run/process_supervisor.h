#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/run/child_process.h"

namespace axlecast {

// The processes of a machine: starts them, starts a dead one again (after 0.5 s, doubling up to 10 s; from the
// beginning once it has run for 30 s), keeps their logs, ends them in order.
class ProcessSupervisor {
 public:
  // In the order in which they end.
  enum class Role : std::uint8_t { kWeb, kDriver, kBridge, kSimulator, kRecorder };

  // `log_directory` exists. `tell` takes the lines that an operator should see.
  ProcessSupervisor(std::string log_directory, const Clock& clock,
                    std::function<void(const std::string& line)> tell);
  ~ProcessSupervisor();  // kills what still runs

  // Starts a program; `argv` begins with its path. One that cannot be started is tried again like one that died.
  void Start(Role role, const std::string& name, std::vector<std::string> argv);

  // Logs what they wrote, notices the dead, starts again what is due. At least ten times a second.
  void Poll();
  [[nodiscard]] std::vector<int> FileDescriptors() const;  // readable when Poll has work

  // Ends all in the order of their roles: SIGTERM, after 3 s (the recorder: 60 s) SIGKILL; SIGKILL at once when
  // `hurry` says so.
  void Stop(const std::function<bool()>& hurry);

  // "driver rs485-0: killed by signal 9 (Killed)" of each process that ended without having been asked to, or with an
  // exit code that is not 0; of one that ended itself with the cause, its last warning or error: "recorder: exit code 1:
  // cannot write into /var/log".
  [[nodiscard]] const std::vector<std::string>& deaths() const { return deaths_; }

 private:
  struct Member {
    Role role;
    std::string name;
    std::vector<std::string> argv;
    ProcessLog log;
    ChildProcess child;
    std::string last_words = {};  // the last line that was worth showing
    MonoNs started = 0;
    MonoNs restart_at = kNever;
    MonoNs back_off = 0;
  };

  void Launch(Member& member);
  void OnEnd(Member& member, const std::string& how);
  void OnStopped(Member& member, const ChildProcess::End& end);
  void ReadLog(Member& member);
  void StopRole(Role role, const std::function<bool()>& hurry);
  [[nodiscard]] bool AnyRunning(Role role) const;

  std::string log_directory_;
  const Clock& clock_;
  std::function<void(const std::string& line)> tell_;
  std::vector<Member> members_;
  std::vector<std::string> deaths_;
};

}  // namespace axlecast
