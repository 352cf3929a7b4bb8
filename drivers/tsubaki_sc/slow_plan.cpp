#include "drivers/tsubaki_sc/slow_plan.h"

#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

void SlowPlan::Restart() { *this = {}; }

void SlowPlan::OnAnswer(const Answer& answer) {
  if (answer.refused()) unknown_ |= 1U << next_;
  if (!answer.ok() && !answer.refused() && ++failures_ < kTries) return;
  Advance(answer.end);
}

void SlowPlan::Advance(MonoNs now) {
  failures_ = 0;
  if (introducing()) ++introduced_;
  due_ = introducing() ? 0 : now + kPeriod;
  for (std::size_t i = 0; i < kItems.size(); ++i) {
    next_ = next_ + 1 < kItems.size() ? next_ + 1 : 0;
    if ((unknown_ >> next_ & 1U) == 0) return;
  }
}

}  // namespace axlecast::tsubaki_sc
