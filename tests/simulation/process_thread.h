#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "core/base/time.h"
#include "tests/simulation/fiber.h"
#include "tests/simulation/host.h"
#include "tests/simulation/schedule.h"

namespace axlecast::simulation {

// The thread of a process that waits in the middle of its calls, as a driver does. It outlives the process: Start begins another one.
class ProcessThread {
 public:
  ProcessThread(Schedule& schedule, Host& host) : schedule_(schedule), host_(host) {}

  // Begins a process now. `body` runs until it is killed.
  void Start(std::function<void()> body);
  // As SIGKILL: the thread runs no further. What its stack owns is destroyed.
  void Kill();
  // As SIGSTOP and SIGCONT: it runs no further until `time` of the schedule.
  void Freeze(MonoNs until) { frozen_until_ = std::max(frozen_until_, until); }
  [[nodiscard]] bool runs() const { return fiber_ && !fiber_->ended(); }

  // From the thread: sleeps until CLOCK_MONOTONIC of the host is `mono`, or until Wake. Runs a little later, as the scheduler of the
  // host lets it.
  void SleepUntil(MonoNs mono);
  // From outside: ends the present sleep.
  void Wake();

 private:
  static constexpr int kMaxSleeps = 20'000;  // at one instant

  void ResumeAt(MonoNs time);

  Schedule& schedule_;
  Host& host_;
  std::unique_ptr<Fiber> fiber_;
  std::int64_t sleep_ = 0;   // number of the present sleep
  bool waits_ = false;       // in SleepUntil, and no wake-up is on its way
  MonoNs frozen_until_ = 0;  // of the schedule
  MonoNs last_sleep_ = 0;
  int sleeps_ = 0;  // at that instant
};

}  // namespace axlecast::simulation
