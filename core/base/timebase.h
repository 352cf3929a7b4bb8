#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// UNIX time of an instant on CLOCK_MONOTONIC: the offset between the two clocks, slewed by at most 500 us per
// second, so that utime stays smooth while an NTP daemon slews; a difference beyond 1 ms is a step and is followed
// at once.
class Timebase {
 public:
  // Both clocks read together. True when UNIX time was stepped since the last call.
  bool Update(MonoNs now, std::int64_t utc_us);
  [[nodiscard]] std::int64_t Utime(MonoNs instant) const { return offset_us_ + instant / kMicrosecond; }
  // Number of steps since the start.
  [[nodiscard]] std::int64_t steps() const { return steps_; }

 private:
  bool started_ = false;
  MonoNs updated_ = 0;
  std::int64_t offset_us_ = 0;
  std::int64_t steps_ = 0;
};

}  // namespace axlecast
