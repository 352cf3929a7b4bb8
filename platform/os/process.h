#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/messages/origin.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// A new identity for a process: random, > 0.
[[nodiscard]] std::int64_t RandomBootId();

// Returns the origin of the messages of this process: a new boot id, the machine of this name (empty: not stated), and the
// clock of this host: its boot, and the time namespace of the process.
[[nodiscard]] Origin NewOrigin(std::string_view machine);

// Returns true if this host is a virtual machine, which may be paused without a trace in its clocks. Known on x86-64 only.
[[nodiscard]] bool IsVirtualMachine();

// 128 random bits: the id of a command, or a token.
[[nodiscard]] std::array<std::uint8_t, 16> RandomId();

// Sets the priority and CPU of the calling thread, and locks the memory of the process. SCHED_FIFO `priority` 1..99, 0: normal
// scheduling; `cpu` -1: any. Also sets the timer slack of the thread to its minimum (usually 50 us). Returns warnings, each with
// its remedy, for settings that the system did not allow; the others are applied.
[[nodiscard]] std::vector<std::string> ApplyRealtime(int priority, int cpu, bool lock_memory);

// Gives the calling thread the lowest priority for the CPU and the disk, as far as the system allows it.
void LowerPriority();

// Prevents core dumps and debuggers without privilege from showing the memory of this process. For a process that holds
// passwords. Afterwards, the process's own files in /proc belong to root.
[[nodiscard]] Result<> ForbidCoreDumps();

// Limits the memory for the data of this process, which processes lengths from untrusted peers. Has no effect under a
// sanitizer, because a sanitizer maps far more memory than it uses.
[[nodiscard]] Result<> LimitMemory(std::size_t bytes);

// Forks for a child that executes another program. A signal that comes before that acts on the child as by default. With
// fork(2) it would run a copy of this process's handler, and the new program would never learn of it.
[[nodiscard]] pid_t ForkWithoutHandlers();

// While this object exists, SIGINT and SIGTERM are requests to stop. Only one may exist in a process. It blocks no signal: threads and
// children start with the usual mask and, after exec, the usual actions.
class StopSignal {
 public:
  StopSignal();
  ~StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;

  [[nodiscard]] bool Requested() const { return Count() > 0; }
  [[nodiscard]] int Count() const;  // an operator may repeat the request
  // Waits at most `timeout_ms` (-1: for ever) for a request. Returns true if there is one.
  [[nodiscard]] bool Wait(int timeout_ms) const;
  // Stays readable once a stop was requested.
  [[nodiscard]] int FileDescriptor() const { return event_.FileDescriptor(); }

 private:
  WakeEvent event_;
};

// Reports the state of the process to systemd (sd_notify). Without systemd, it does nothing.
class Supervision {
 public:
  Supervision();

  void Ready();
  void Status(const std::string& text);  // one line for `systemctl status`
  void Stopping();

  // Call it in every cycle of the main loop. It triggers the watchdog, at most three times per WatchdogSec. If the loop hangs,
  // systemd restarts the process.
  void Progress(MonoNs now) {
    if (now >= next_ping_) Ping(now);
  }
  // The longest allowed time between two calls of Progress; kNever without a watchdog.
  [[nodiscard]] MonoNs ping_interval() const { return interval_; }

 private:
  void Ping(MonoNs now);

  MonoNs interval_ = kNever;
  MonoNs next_ping_ = kNever;
};

}  // namespace axlecast
