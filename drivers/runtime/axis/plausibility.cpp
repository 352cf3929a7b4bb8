#include "drivers/runtime/axis/plausibility.h"

#include <algorithm>

namespace axlecast {
namespace {

// Anchors are so far apart: the longer the way to one, the better it tells the speed; the shorter, the less it has
// changed since. The noise of an encoder against 1,000 to 80,000 rad/s2 is best at 0.1 to 1.5 ms.
constexpr MonoNs kBetweenAnchors = kMillisecond;

bool FarApart(const UnwrappedSample& from, const UnwrappedSample& to) {
  return to.at.first - from.at.last >= kBetweenAnchors;
}

}  // namespace

bool Plausibility::Agrees(const UnwrappedSample& fix) const {
  return limits_.SpeedAllows(last_, fix) && AccelerationAllows(fix);
}

bool Plausibility::AccelerationAllows(const UnwrappedSample& fix) const {
  if (has_before_ && !limits_.AccelerationAllows(before_, last_, fix)) return false;
  for (std::size_t i = 0; i < anchor_count_; ++i) {
    if (!limits_.AccelerationAllows(anchors_[i], last_, fix)) return false;
  }
  if (anchor_count_ == 0) return true;
  const std::size_t newest = FarApart(anchors_[0], fix) ? 0 : 1;
  if (newest + 1 >= anchor_count_) return true;
  return limits_.AccelerationAllows(anchors_[newest + 1], anchors_[newest], fix);
}

void Plausibility::Accept(const UnwrappedSample& fix, bool continuous) {
  has_before_ = known_ && continuous;
  before_ = last_;
  if (!continuous) anchor_count_ = 0;
  last_ = fix;
  known_ = true;
  run_ = 0;
  if (anchor_count_ == 0 || FarApart(anchors_[0], fix)) PushAnchor(fix);
}

void Plausibility::PushAnchor(const UnwrappedSample& fix) {
  anchors_[2] = anchors_[1];
  anchors_[1] = anchors_[0];
  anchors_[0] = fix;
  anchor_count_ = std::min(anchor_count_ + 1, anchors_.size());
}

Plausibility::Doubt Plausibility::TakeDoubtful(const UnwrappedSample& fix) {
  // The jump from 5 bits to full resolution is no fault (TS5669 spec 6.4, FS).
  if (known_ && last_.low_accuracy && !fix.low_accuracy) Forget();

  const bool first = run_ == 0;
  run_ = !first && limits_.SpeedAllows(doubted_, fix) ? run_ + 1 : 1;
  doubted_ = fix;
  if (!known_) {
    if (run_ < kRunToBegin) return first ? Doubt::kFirst : Doubt::kImplausible;
    Accept(fix, false);
    return Doubt::kAcceptedAtStart;
  }
  if (hold_ || run_ < run_to_overthrow_) return Doubt::kImplausible;
  const bool repaired = has_before_ && limits_.SpeedAllows(before_, fix);
  Accept(fix, false);
  return repaired ? Doubt::kPreviousWasWrong : Doubt::kAcceptedAfterJump;
}

void Plausibility::Hold(bool hold) {
  hold_ = hold;
  run_ = 0;
}

void Plausibility::Shift(std::int64_t counts) {
  last_.counts += counts;
  doubted_.counts += counts;
  has_before_ = false;
  anchor_count_ = 0;
}

void Plausibility::Forget() {
  known_ = false;
  has_before_ = false;
  anchor_count_ = 0;
  run_ = 0;
}

}  // namespace axlecast
