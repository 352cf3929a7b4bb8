#pragma once

#include <csignal>
#include <ctime>

#include "core/base/time.h"

namespace axlecast {

// Ends the blocking system calls of a thread at a deadline: they fail with EINTR. A read that waits itself takes one system call;
// with ppoll before it, two. The kernel's timer sends a signal to the thread (SIGRTMIN), which every other call of the thread has to
// expect as well. The timer is set for the first of many calls and left alone while the deadlines of the next are later, so
// that it pays where a deadline is many calls away. Each thread has one.
class CallTimer {
 public:
  // Of the calling thread.
  [[nodiscard]] static CallTimer& OfThisThread();
  ~CallTimer();
  CallTimer(const CallTimer&) = delete;
  CallTimer& operator=(const CallTimer&) = delete;

  // The calls from now on end at `deadline` of `clock`, up to 100 us later if the timer expired directly before the call, or earlier:
  // after EINTR, the caller compares the time, and calls this again. Returns false if the kernel grants no timer (ulimit -i).
  [[nodiscard]] bool Set(MonoNs deadline, const Clock& clock);
  // Returns true if Set would have nothing to do.
  [[nodiscard]] bool IsSet(MonoNs deadline) const { return expired_ == 0 && set_to_ <= deadline; }
  // The calls from now on are not meant. The timer may still interrupt one of them.
  void Clear();

 private:
  CallTimer();
  static void OnExpiry(int signal, siginfo_t* info, void* context);
  [[nodiscard]] bool Start(MonoNs from_now);

  timer_t timer_{};
  bool exists_ = false;
  MonoNs set_to_ = kNever;             // while it runs
  volatile sig_atomic_t expired_ = 1;  // or stopped: it must be started
  volatile sig_atomic_t in_call_ = 0;
};

}  // namespace axlecast
