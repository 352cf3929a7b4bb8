#include "platform/os/call_timer.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>

namespace axlecast {
namespace {

// A timer that expires between the caller's look at the time and its call would not end the call: it expires again.
constexpr MonoNs kAgain = 100 * kMicrosecond;

// Of the running thread; null before and after it has a timer. The handler takes it from here, not from the signal, which another
// process can forge.
thread_local CallTimer* timer_of_thread = nullptr;

timespec Span(MonoNs duration) { return {duration / kSecond, duration % kSecond}; }

}  // namespace

CallTimer& CallTimer::OfThisThread() {
  thread_local CallTimer timer;
  return timer;
}

CallTimer::CallTimer() {
  struct sigaction action {};
  action.sa_sigaction = &OnExpiry;
  action.sa_flags = SA_SIGINFO;  // without SA_RESTART, so that the call ends
  sigevent event{};
  event.sigev_notify = SIGEV_THREAD_ID;
  event.sigev_signo = SIGRTMIN;
  event._sigev_un._tid = static_cast<pid_t>(syscall(SYS_gettid));
  timer_of_thread = this;
  exists_ = sigaction(SIGRTMIN, &action, nullptr) == 0 && timer_create(CLOCK_MONOTONIC, &event, &timer_) == 0;
}

CallTimer::~CallTimer() {
  if (exists_) timer_delete(timer_);
  timer_of_thread = nullptr;
}

bool CallTimer::Set(MonoNs deadline, const Clock& clock) {
  if (!exists_) return false;
  in_call_ = 1;
  std::atomic_signal_fence(std::memory_order_seq_cst);
  if (IsSet(deadline)) return true;
  expired_ = 0;
  set_to_ = deadline;
  if (Start(std::max<MonoNs>(deadline - clock.Now(), 1))) return true;
  expired_ = 1;
  Clear();
  return false;
}

void CallTimer::Clear() {
  in_call_ = 0;
  std::atomic_signal_fence(std::memory_order_seq_cst);
}

bool CallTimer::Start(MonoNs from_now) {
  const itimerspec times{.it_interval = Span(kAgain), .it_value = Span(from_now)};
  return timer_settime(timer_, 0, &times, nullptr) == 0;
}

// Uses only what POSIX allows in a signal handler.
void CallTimer::OnExpiry(int /*signal*/, siginfo_t* info, void* /*context*/) {
  CallTimer* const timer = timer_of_thread;
  if (timer == nullptr || info->si_code != SI_TIMER) return;  // another process sent it
  timer->expired_ = 1;
  if (timer->in_call_ != 0) return;
  const int error = errno;
  const itimerspec never{};
  timer_settime(timer->timer_, 0, &never, nullptr);
  errno = error;
}

}  // namespace axlecast
