#include "drivers/runtime/axis/standstill.h"

#include <algorithm>
#include <cmath>

namespace axlecast {
namespace {

constexpr std::int64_t kTolerancesPerTurn = 3'600;  // 0.1 degrees
constexpr std::int64_t kMinTolerance = 2;
constexpr MonoNs kSpeedStep = 5 * kMillisecond;
constexpr double kNsPerMinute = 60e9;

}  // namespace

Standstill::Standstill(std::int64_t counts_per_turn, std::int64_t noise_counts)
    : counts_per_turn_(counts_per_turn),
      tolerance_(2 * noise_counts + std::max(kMinTolerance, counts_per_turn / kTolerancesPerTurn)) {}

void Standstill::BeginWatch(const UnwrappedSample& fix) {
  any_ = true;
  moved_ = false;
  watched_since_ = fix.at.Middle();
  stretch_since_ = fix.at.Middle();
  step_from_ = fix;
  fastest_ = 0;
  fastest_before_ = 0;
  BeginWindow(fix);
}

void Standstill::BeginWindow(const UnwrappedSample& fix) {
  since_ = fix.at.Middle();
  least_ = fix.counts;
  most_ = fix.counts;
  established_ = false;
}

void Standstill::Add(const UnwrappedSample& fix, bool continuous) {
  if (!any_ || fix.at.first - last_.at.last > kOldest) {
    BeginWatch(fix);
  } else {
    Extend(fix, continuous);
    MeasureSpeed(fix);
  }
  last_ = fix;
}

void Standstill::Extend(const UnwrappedSample& fix, bool continuous) {
  const std::int64_t minimum = std::min(least_, fix.counts);
  const std::int64_t maximum = std::max(most_, fix.counts);
  const bool moved = maximum - minimum > tolerance_;
  moved_ = moved_ || moved;
  if (moved || (!continuous && !established_)) {
    BeginWindow(fix);
    return;
  }
  least_ = minimum;
  most_ = maximum;
  if (fix.at.Middle() - since_ >= kCover) established_ = true;
}

void Standstill::MeasureSpeed(const UnwrappedSample& fix) {
  const MonoNs step = fix.at.Middle() - step_from_.at.Middle();
  if (step < kSpeedStep) return;
  if (fix.at.Middle() - stretch_since_ >= kCover) {
    fastest_before_ = fastest_;
    fastest_ = 0;
    stretch_since_ = fix.at.Middle();
  }
  const double distance = std::abs(static_cast<double>(fix.counts - step_from_.counts));
  fastest_ = std::max(fastest_, distance / static_cast<double>(step));
  step_from_ = fix;
}

Motion Standstill::At(MonoNs now) const {
  Motion motion;
  if (!any_) return motion;
  motion.counts = last_.counts;
  motion.at = last_.at.Middle();
  motion.speed_rpm = std::max(fastest_, fastest_before_) * kNsPerMinute / static_cast<double>(counts_per_turn_);
  if (now - last_.at.last > kOldest) return motion;
  motion.standstill = established_;
  motion.known = established_ || (moved_ && last_.at.Middle() - watched_since_ >= kCover);
  return motion;
}

}  // namespace axlecast
