#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// When a message that repeats each second, and tells changes, was and will be sent: DEVICE and ALARM.
class PublishTimer {
 public:
  static constexpr MonoNs kPeriod = kSecond;
  static constexpr MonoNs kSoonest = 20 * kMillisecond;  // between two that tell a change

  // `revision`: of what the message tells.
  [[nodiscard]] bool Due(std::int64_t revision, MonoNs now) {
    if (sent_ && now - sent_at_ < (revision == told_ ? kPeriod : kSoonest)) return false;
    sent_ = true;
    sent_at_ = now;
    told_ = revision;
    return true;
  }

 private:
  bool sent_ = false;
  MonoNs sent_at_ = 0;
  std::int64_t told_ = 0;
};

}  // namespace axlecast
