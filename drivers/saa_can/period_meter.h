#pragma once

#include "core/base/time.h"

namespace axlecast::saa_can {

// The period of frames that an encoder sends by itself, from their arrivals.
class PeriodMeter {
 public:
  static constexpr int kPeriods = 5;

  void Add(MonoNs at) {
    if (frames_++ == 0) first_ = at;
    last_ = at;
  }
  [[nodiscard]] bool done() const { return frames_ > kPeriods; }
  // 0 before the second frame.
  [[nodiscard]] MonoNs Mean() const { return frames_ < 2 ? 0 : (last_ - first_) / (frames_ - 1); }
  // Within a quarter of the nominal one: the manual's own log is 6.4 % off.
  [[nodiscard]] bool Fits(MonoNs nominal) const {
    const MonoNs off = Mean() > nominal ? Mean() - nominal : nominal - Mean();
    return off * 4 <= nominal;
  }
  // For a meter to be done, at most.
  [[nodiscard]] static MonoNs Patience(MonoNs nominal) { return 2 * kSecond + 2 * kPeriods * nominal; }

 private:
  int frames_ = 0;
  MonoNs first_ = 0;
  MonoNs last_ = 0;
};

}  // namespace axlecast::saa_can
