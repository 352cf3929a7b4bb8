#pragma once

#include "core/base/time.h"

namespace axlecast {

// A clock that stands still until a test moves it.
class FakeClock final : public Clock {
 public:
  explicit FakeClock(MonoNs start = 1'000 * kSecond) : now_(start) {}

  [[nodiscard]] MonoNs Now() const override { return now_; }
  [[nodiscard]] std::int64_t UtcMicroseconds() const override { return utc_offset_us_ + now_ / kMicrosecond; }

  void Advance(MonoNs by) { now_ += by; }
  void MoveTo(MonoNs to) { now_ = to; }
  void StepUtc(std::int64_t by_us) { utc_offset_us_ += by_us; }

 private:
  MonoNs now_;
  std::int64_t utc_offset_us_ = 1'700'000'000'000'000;
};

}  // namespace axlecast
