#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"
#include "core/config/ticks.h"
#include "core/time/base_claim.h"

namespace axlecast {

// Absolute poll slots: one for each tick, at the same instants on every bus and host with the same base and the same settings. A missed
// slot is counted as late and skipped, so that slots never come in bursts. Period 0: always due.
//
// The base of the machine may be known late, or change. The slots then move towards its ticks by at most 1 % of the period per slot.
// While there is no claim about the base, the slots keep their pace and have no numbers.
class SlotClock {
 public:
  static constexpr MonoNs kSlewDivisor = 100;  // of the period, per slot

  // `base`: the time base of the machine; null: CLOCK_MONOTONIC is the base. It outlives the slots.
  explicit SlotClock(const Ticks& ticks, const BaseClaims* base = nullptr) : ticks_(ticks), base_(base) {}

  // Begins with the first slot at or after `now`; earlier ones do not count as late.
  void Start(MonoNs now);

  [[nodiscard]] bool Due(MonoNs now) const { return now >= next_; }
  [[nodiscard]] MonoNs next() const { return next_; }

  // Uses the slot that began last before `now`. Earlier unused slots were missed. Returns the number of its tick; kNoTick if it is not
  // known to within a quarter of the period.
  std::int64_t Take(MonoNs now);
  // Slots before `until` may pass unused: the device does not need them.
  void Excuse(MonoNs until) { excused_until_ = until; }

  [[nodiscard]] std::int64_t late() const { return late_; }

 private:
  [[nodiscard]] std::optional<BaseClaim> Base(MonoNs mono) const;
  // Returns the number of the tick of the slot, and moves the next slots towards the ticks of the base.
  std::int64_t Follow(MonoNs slot);
  void CountLate(MonoNs now);

  Ticks ticks_;
  const BaseClaims* base_;
  MonoNs next_ = 0;  // start of the next slot; with period 0 in the past
  MonoNs excused_until_ = 0;
  std::int64_t late_ = 0;
};

}  // namespace axlecast
