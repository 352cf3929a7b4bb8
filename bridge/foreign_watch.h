#pragma once

#include <cstdint>

#include "drivers/runtime/core/instant.h"

namespace axlecast {

// Counts commands and statuses that may not act, so that a flood raises one alarm and a line in the log now and then.
class ForeignWatch {
 public:
  static constexpr MonoNs kRecent = 60 * kSecond;  // how long one keeps the alarm up
  static constexpr MonoNs kTellEvery = 10 * kSecond;

  // True when it is time to tell.
  bool Count(MonoNs now) {
    ++count_;
    last_ = now;
    any_ = true;
    if (told_ != 0 && now - told_ < kTellEvery) return false;
    told_ = now;
    return true;
  }
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] bool Recent(MonoNs now) const { return any_ && now - last_ < kRecent; }

 private:
  std::int64_t count_ = 0;
  MonoNs last_ = 0;
  MonoNs told_ = 0;
  bool any_ = false;
};

}  // namespace axlecast
