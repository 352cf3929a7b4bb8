#include "drivers/runtime/axis/turn_counter.h"

#include <algorithm>

#include "drivers/runtime/axis/counts.h"

namespace axlecast {

TurnCounter::TurnCounter(const DeviceConfig& device, const MotionLimits& limits)
    : limits_(limits),
      counts_per_turn_(device.settings->counts_per_turn),
      turns_range_(device.settings->turns_range),
      period_(counts_per_turn_ * std::max<std::int64_t>(turns_range_, 1)),
      mode_(device.turns) {}

std::int64_t TurnCounter::Said(const Sample& sample) const {
  const std::int64_t turns = HoldsTurns(sample) ? FloorMod(sample.turns, turns_range_) : 0;
  return turns * counts_per_turn_ + FloorMod(sample.counts, counts_per_turn_);
}

std::int64_t TurnCounter::WithinEnds(std::int64_t said, std::int64_t period) const {
  return mode_ == TurnsMode::kSigned ? Nearest(said, period, 0) : FloorMod(said, period);
}

UnwrappedSample TurnCounter::First(const Sample& sample, std::optional<std::int64_t> origin) const {
  const std::int64_t period = has_counter() && !sample.has_turns ? counts_per_turn_ : period_;
  const std::int64_t said = Said(sample);
  const bool near_origin = mode_ == TurnsMode::kModulo && origin.has_value();
  return {near_origin ? Nearest(said, period, *origin) : WithinEnds(said, period), sample.at, sample.low_accuracy};
}

TurnCounter::Unwrapped TurnCounter::Follow(const UnwrappedSample& from, const Sample& sample) const {
  if (!has_counter()) return Nearer(from, sample, period_, true);
  if (aligned_ && sample.has_turns) {
    const Unwrapped by_counter = Nearer(from, sample, period_, true);
    if (sample.turns_trusted || limits_.SpeedAllows(from, by_counter.fix)) return by_counter;
  }
  return Nearer(from, sample, counts_per_turn_, false);
}

TurnCounter::Unwrapped TurnCounter::Nearer(const UnwrappedSample& from, const Sample& sample, std::int64_t period,
                                           bool whole) const {
  Unwrapped unwrapped{.fix = {0, sample.at, sample.low_accuracy}, .by_counter = whole && has_counter()};
  unwrapped.continuous = limits_.Reach(from, unwrapped.fix) < static_cast<double>(period) / 2;
  const bool by_ends = !unwrapped.continuous && whole && mode_ != TurnsMode::kModulo;
  const std::int64_t said = Said(sample);
  unwrapped.fix.counts = by_ends ? WithinEnds(said, period) : Nearest(said, period, from.counts);
  return unwrapped;
}

void TurnCounter::Begin(const Sample& sample, bool sure) {
  believed_ = sample.turns_trusted;
  aligned_ = HoldsTurns(sample) && sample.turns_trusted;
  sure_ = has_counter() ? aligned_ : !OnlyCounted() || sure;
  contradictions_ = 0;
}

TurnCounter::Change TurnCounter::Accept(const Unwrapped& unwrapped, const Sample& sample) {
  Change change;
  change.was_sure = sure_;
  if (!has_counter()) {
    if (!unwrapped.continuous && OnlyCounted()) sure_ = false;
    change.lost_turns = change.was_sure && !sure_;
    return change;
  }
  if (!sample.turns_trusted) {
    aligned_ = aligned_ && unwrapped.by_counter;
    if (believed_) sure_ = false;
    believed_ = false;
  } else if (sample.has_turns) {
    believed_ = true;
    if (unwrapped.by_counter) sure_ = true;
  }
  if (!unwrapped.by_counter && !unwrapped.continuous) {
    aligned_ = false;
    sure_ = false;
    change.lost_turns = change.was_sure && !believed_;
  }
  if (!aligned_ && sample.has_turns && sample.turns_trusted) change.correction = Align(unwrapped, sample);
  return change;
}

std::int64_t TurnCounter::Align(const Unwrapped& unwrapped, const Sample& sample) {
  const std::int64_t contradiction = Nearest(Said(sample), period_, unwrapped.fix.counts) - unwrapped.fix.counts;
  contradictions_ = contradictions_ > 0 && contradiction == contradiction_ ? contradictions_ + 1 : 1;
  contradiction_ = contradiction;
  if (contradiction != 0 && contradictions_ < kContradictionsToBelieve) return 0;
  contradictions_ = 0;
  aligned_ = true;
  sure_ = true;
  return contradiction;
}

void TurnCounter::Distrust() {
  if (OnlyCounted()) sure_ = false;
}

bool TurnCounter::CountedByDriver(const Sample& sample) const {
  return !(HoldsTurns(sample) && sample.turns_trusted && aligned_);
}

std::int64_t TurnCounter::NearOrigin(std::int64_t counts, std::int64_t origin) const {
  const bool open = mode_ == TurnsMode::kModulo && (sure_ || !has_counter());
  return open ? Nearest(counts, period_, origin) : counts;
}

bool TurnCounter::Outside(std::int64_t counts) const {
  if (mode_ == TurnsMode::kModulo) return false;
  const std::int64_t first = mode_ == TurnsMode::kSigned ? -(period_ / 2) : 0;
  return counts < first || counts - first >= period_;
}

}  // namespace axlecast
