#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Whether somebody sends orders that this driver refuses: at once with the first one, then judged every 10 s.
class UnauthorizedCommandCounter {
 public:
  static constexpr MonoNs kPeriod = 10 * kSecond;

  // `refused`: orders refused since the start. True when present() has changed.
  bool Update(std::int64_t refused, MonoNs now) {
    if (now < next_) return false;
    const bool was = present_;
    present_ = refused != seen_;
    seen_ = refused;
    if (present_ || was) next_ = now + kPeriod;
    return present_ != was;
  }
  [[nodiscard]] bool present() const { return present_; }

 private:
  std::int64_t seen_ = 0;
  bool present_ = false;
  MonoNs next_ = 0;
};

}  // namespace axlecast
