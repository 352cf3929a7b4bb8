#include "drivers/runtime/bus/slot_clock.h"

#include <algorithm>
#include <cstdlib>

namespace axlecast {
namespace {

// Returns what `instant` is after the begin of its period, in [0, period).
MonoNs Into(MonoNs instant, MonoNs period) {
  const MonoNs rest = instant % period;
  return rest < 0 ? rest + period : rest;
}

}  // namespace

std::optional<BaseClaim> SlotClock::Base(MonoNs mono) const {
  if (base_ != nullptr) return base_->At(mono);
  return BaseClaim{.base_id = 0, .base_ns = mono, .half_width_ns = 0};
}

void SlotClock::Start(MonoNs now) {
  excused_until_ = 0;
  if (ticks_.period <= 0) {
    next_ = now;
    return;
  }
  const auto claim = Base(now);
  const MonoNs into_slot = Into((claim ? claim->base_ns : now) + ticks_.lead - ticks_.phase, ticks_.period);
  next_ = into_slot == 0 ? now : now - into_slot + ticks_.period;
}

std::int64_t SlotClock::Take(MonoNs now) {
  if (ticks_.period <= 0) return kNoTick;
  CountLate(now);
  const MonoNs slot = next_;
  next_ += ticks_.period;
  excused_until_ = 0;
  return Follow(slot);
}

void SlotClock::CountLate(MonoNs now) {
  if (now - next_ < ticks_.period) return;
  const std::int64_t missed = (now - next_) / ticks_.period;
  const MonoNs unwanted = std::min(excused_until_, now) - next_;
  const std::int64_t excused = unwanted > 0 ? (unwanted + ticks_.period - 1) / ticks_.period : 0;
  late_ += std::max<std::int64_t>(0, missed - excused);
  next_ += missed * ticks_.period;
}

std::int64_t SlotClock::Follow(MonoNs slot) {
  const auto claim = Base(slot);
  if (!claim) return kNoTick;
  const MonoNs planned = claim->base_ns + ticks_.lead - ticks_.phase;  // of the base, 0 is tick 0
  MonoNs after_tick = Into(planned, ticks_.period);
  if (after_tick > ticks_.period / 2) after_tick -= ticks_.period;
  const MonoNs step = std::max<MonoNs>(1, ticks_.period / kSlewDivisor);
  next_ -= std::clamp(after_tick, -step, step);
  if (std::abs(after_tick) + claim->half_width_ns > ticks_.period / 4) return kNoTick;
  return std::max(kNoTick, (planned - after_tick) / ticks_.period);
}

}  // namespace axlecast
