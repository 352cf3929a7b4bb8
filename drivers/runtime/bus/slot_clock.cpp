#include "drivers/runtime/bus/slot_clock.h"

#include <algorithm>

namespace axlecast {

void SlotClock::Start(MonoNs now) {
  excused_until_ = 0;
  if (period_ <= 0) {
    next_ = now;
    return;
  }
  MonoNs into_slot = (now - phase_) % period_;
  if (into_slot < 0) into_slot += period_;
  next_ = into_slot == 0 ? now : now - into_slot + period_;
}

void SlotClock::Take(MonoNs now) {
  if (period_ <= 0) return;
  if (now - next_ >= period_) {
    const std::int64_t missed = (now - next_) / period_;
    const MonoNs unwanted = std::min(excused_until_, now) - next_;
    const std::int64_t excused = unwanted > 0 ? (unwanted + period_ - 1) / period_ : 0;
    late_ += std::max<std::int64_t>(0, missed - excused);
    next_ += missed * period_;
  }
  next_ += period_;
  excused_until_ = 0;
}

}  // namespace axlecast
