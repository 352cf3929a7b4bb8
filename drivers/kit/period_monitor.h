#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Watches a stream that should come once per `period`, and says when it has fallen silent: when nothing has come
// for `tolerance` periods.
class PeriodMonitor {
 public:
  PeriodMonitor(MonoNs period, int tolerance) : limit_(period * tolerance) {}

  // The stream may begin now; or one of it came.
  void Arrived(MonoNs now) {
    last_ = now;
    reported_ = false;
  }

  // When to ask again.
  [[nodiscard]] MonoNs due() const { return reported_ ? kNever : last_ + limit_; }

  // True once for every time that the stream falls silent.
  [[nodiscard]] bool FellSilent(MonoNs now) {
    if (reported_ || now < due()) return false;
    reported_ = true;
    return true;
  }
  [[nodiscard]] bool silent() const { return reported_; }

 private:
  MonoNs limit_;
  MonoNs last_ = 0;
  bool reported_ = true;  // nothing is expected before the first Arrived
};

}  // namespace axlecast
