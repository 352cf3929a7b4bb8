#pragma once

#include <algorithm>

#include "core/base/time.h"

namespace axlecast::saa_can {

// Keeps one request under way, though nothing in a position says to which request it belongs. One that came unasked
// would let the next request out too early, and leave two under way for good. So after an answer that came much sooner
// than usual the right one is waited for as well.
class AnswerPace {
 public:
  void Asked(MonoNs now) {
    // Nothing else came: the early answer was the right one.
    if (early_) usual_ -= (usual_ - early_took_) / kQuickForgetting;
    early_ = false;
    asked_at_ = now;
    free_at_ = now;
  }
  // A position came while one was awaited.
  void Answered(MonoNs now) {
    const MonoNs took = now - asked_at_;
    early_ = took * 4 < usual_ * 3;
    if (early_) {
      early_took_ = took;
      free_at_ = asked_at_ + usual_ + usual_ / 4;
    } else {
      usual_ = std::max(took, usual_ - (usual_ - took) / kForgetting);
    }
  }
  // One came while none was awaited: the right one, after an early one.
  void CameUnasked(MonoNs now) {
    early_ = false;
    free_at_ = now;
  }
  // The next request may go out then.
  [[nodiscard]] MonoNs free_at() const { return free_at_; }

 private:
  static constexpr MonoNs kForgetting = 16;
  static constexpr MonoNs kQuickForgetting = 4;

  MonoNs usual_ = 0;  // from a request to its answer, rather the longest lately
  MonoNs asked_at_ = 0;
  MonoNs free_at_ = 0;
  bool early_ = false;
  MonoNs early_took_ = 0;
};

}  // namespace axlecast::saa_can
