#pragma once

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "platform/os/descriptor.h"
#include "tools/axlecast/common/program.h"

namespace axlecast {

// A program run as a child in a session of its own: the terminal's Ctrl-C does not reach it, and it is killed when
// the parent dies, however the parent dies. What it writes to standard error is read line by line.
class ChildProcess {
 public:
  ChildProcess() = default;
  ~ChildProcess();  // kills what still runs
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;

  // `argv` begins with the program's path; its standard output goes to the file `output`, or nowhere (-1). An empty
  // string when it runs, else why not. Call it on the main thread: the child's life is tied to the thread that
  // starts it.
  [[nodiscard]] std::string Start(const std::vector<std::string>& argv, int output);

  // Lines that have come and are complete; after the end also an unfinished one. Never waits.
  [[nodiscard]] std::vector<std::string> ReadLines();

  // How it ended ("exit code 3", "killed by signal 9 (Killed)"); nothing while it runs. Tells it once.
  struct End {
    bool clean = false;  // exit code 0
    std::string text;
  };
  [[nodiscard]] std::optional<End> Reap();

  void Signal(int signal) const;  // to it and to what it started
  [[nodiscard]] bool running() const { return pid_ > 0; }
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] int FileDescriptor() const { return errors_.get(); }  // readable when ReadLines has work

 private:
  pid_t pid_ = -1;
  Descriptor errors_;
  std::string partial_;
};

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
