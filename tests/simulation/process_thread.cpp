#include "tests/simulation/process_thread.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace axlecast::simulation {

void ProcessThread::Start(std::function<void()> body) {
  fiber_ = std::make_unique<Fiber>(std::move(body));
  ++sleep_;
  frozen_until_ = 0;
  ResumeAt(schedule_.now());
}

void ProcessThread::Kill() {
  ++sleep_;  // what would resume it is void
  waits_ = false;
  fiber_.reset();
}

void ProcessThread::SleepUntil(MonoNs mono) {
  sleeps_ = schedule_.now() == last_sleep_ ? sleeps_ + 1 : 0;
  last_sleep_ = schedule_.now();
  if (sleeps_ > kMaxSleeps) throw std::logic_error("a process turns in circles at one instant");
  ++sleep_;
  waits_ = true;
  if (mono != kNever) ResumeAt(std::max(host_.clock.TimeOf(mono), schedule_.now()) + host_.Late());
  fiber_->Suspend();
  waits_ = false;
}

void ProcessThread::Wake() {
  if (!waits_) return;
  waits_ = false;
  ResumeAt(schedule_.now() + host_.Late());
}

void ProcessThread::ResumeAt(MonoNs time) {
  schedule_.At(time, [this, sleep = sleep_] {
    if (sleep != sleep_ || !fiber_) return;
    if (schedule_.now() < frozen_until_) return ResumeAt(frozen_until_);
    ++sleep_;  // the other wake-up of this sleep is void
    fiber_->Resume();
  });
}

}  // namespace axlecast::simulation
