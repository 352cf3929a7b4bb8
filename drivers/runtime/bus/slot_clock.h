#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Absolute slots on CLOCK_MONOTONIC: phase + k x period, the same instants on every bus with the same figures.
// A slot that was missed is counted as late and skipped; slots never come in bursts. Period 0: always due.
class SlotClock {
 public:
  SlotClock(MonoNs period, MonoNs phase) : period_(period), phase_(phase) {}

  // Begins with the first slot at or after `now`; earlier ones do not count as late.
  void Start(MonoNs now);

  [[nodiscard]] bool Due(MonoNs now) const { return now >= next_; }
  [[nodiscard]] MonoNs next() const { return next_; }

  // The slot that is due at `now` is used: that which began last. Those before it were missed.
  void Take(MonoNs now);
  // Slots before `until` may pass unused: whom they are for does not want them.
  void Excuse(MonoNs until) { excused_until_ = until; }

  [[nodiscard]] std::int64_t late() const { return late_; }

 private:
  MonoNs period_;
  MonoNs phase_;
  MonoNs next_ = 0;  // start of the next slot; with period 0 the past
  MonoNs excused_until_ = 0;
  std::int64_t late_ = 0;
};

}  // namespace axlecast
