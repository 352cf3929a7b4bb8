#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Counts commands and statuses that may not act, so that a flood raises one alarm and a line in the log now and then.
class UnauthorizedMessageCounter {
 public:
  static constexpr MonoNs kRecent = 60 * kSecond;  // how long one keeps the alarm up
  static constexpr MonoNs kTellEvery = 10 * kSecond;
  static constexpr int kAnswersPerSecond = 100;

  // True when it is time to tell.
  bool Count(MonoNs now) {
    ++count_;
    last_ = now;
    any_ = true;
    if (told_ != 0 && now - told_ < kTellEvery) return false;
    told_ = now;
    return true;
  }
  // Whether its sender is told, so that a flood is not answered by another.
  [[nodiscard]] bool MayAnswer(MonoNs now) {
    if (now - answers_from_ >= kSecond) {
      answers_from_ = now;
      answers_ = 0;
    }
    return ++answers_ <= kAnswersPerSecond;
  }
  [[nodiscard]] std::int64_t count() const { return count_; }
  [[nodiscard]] bool Recent(MonoNs now) const { return any_ && now - last_ < kRecent; }

 private:
  std::int64_t count_ = 0;
  MonoNs last_ = 0;
  MonoNs told_ = 0;
  bool any_ = false;
  MonoNs answers_from_ = 0;
  int answers_ = 0;
};

}  // namespace axlecast
