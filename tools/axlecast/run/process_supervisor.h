#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "platform/os/descriptor.h"
#include "tools/axlecast/common/program.h"

namespace axlecast {

// A child process in its own session: Ctrl-C at the terminal does not reach it. It is killed if the parent ends for any
// reason. Its standard error is read line by line.
class ChildProcess {
 public:
  ChildProcess() = default;
  ~ChildProcess();  // kills a running process
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  // `argv` begins with the program's path. Its standard output is written to the file `output`, or discarded (-1). Call it
  // on the main thread: the child is killed if the thread that started it ends.
  [[nodiscard]] Result<> Start(const std::vector<std::string>& argv, int output);

  // Returns the complete lines received so far; after the end of the process also an incomplete one. Does not wait.
  [[nodiscard]] std::vector<std::string> ReadLines();

  // Returns once how the process ended: "exit code 3", "killed by signal 9 (Killed)". Returns nothing while it runs.
  struct End {
    bool clean = false;  // exit code 0
    std::string text;
  };
  [[nodiscard]] std::optional<End> Reap();

  void Signal(int signal) const;  // to the process and its children
  [[nodiscard]] bool running() const { return pid_ > 0; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] int FileDescriptor() const { return errors_.get(); }  // readable if ReadLines has work

 private:
  pid_t pid_ = -1;
  Descriptor errors_;
  std::string partial_;
};

// Starts the processes of a machine, restarts those that end, writes their logs, and ends them in order. The delay of a
// restart is 0.5 s and doubles up to 10 s. It is 0.5 s again for a process that ran for 30 s.
class ProcessSupervisor {
 public:
  // In the order in which they are ended.
  enum class Role : std::uint8_t { kWeb, kDriver, kBridge, kSimulator, kRecorder };

  // `log_directory` must exist. `show` receives the lines that an operator should see.
  ProcessSupervisor(std::string log_directory, const Clock& clock,
                    std::function<void(const std::string& line)> show);
  ~ProcessSupervisor();  // kills running processes

  // Starts a program; `argv` begins with its path. A program that cannot be started is retried like one that ended.
  void Start(Role role, const std::string& name, std::vector<std::string> argv);

  // Logs the output, detects ended processes, and restarts those that are due. Call it at least ten times per second.
  void Poll();
  [[nodiscard]] std::vector<int> FileDescriptors() const;  // readable if Poll has work

  // Ends all processes in the order of their roles: SIGTERM, and SIGKILL after 3 s (recorder: 60 s), or as soon as `hurry`
  // returns true.
  void Stop(const std::function<bool()>& hurry);

  // Returns an entry for each process that ended without a request, or with an exit code other than 0: "driver rs485-0:
  // killed by signal 9 (Killed)". An exit code is followed by the last warning or error: "recorder: exit code 1: cannot
  // write into /var/log".
  [[nodiscard]] const std::vector<std::string>& deaths() const { return deaths_; }

 private:
  struct Member {
    Role role;
    std::string name;
    std::vector<std::string> argv;
    ProcessLog log;
    ChildProcess child;
    std::string last_shown = {};  // the last line that was shown
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
  std::function<void(const std::string& line)> show_;
  std::vector<Member> members_;
  std::vector<std::string> deaths_;
};

}  // namespace axlecast
