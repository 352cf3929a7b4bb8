#include "drivers/runtime/axis/motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace axlecast {
namespace {

constexpr double kNsPerSecond = 1e9;
constexpr double kNsPerMinute = 60e9;
constexpr std::int64_t kLowAccuracySteps = 32;  // 5 bits

// The possible mean speeds over an interval, in counts per ns.
struct SpeedRange {
  double minimum;
  double maximum;
};

SpeedRange MeanSpeed(double distance, double error, double shortest, double longest) {
  const double low = distance - error;
  const double high = distance + error;
  return {low / (low >= 0 ? longest : shortest), high / (high >= 0 ? shortest : longest)};
}

// The time between two anchors. A longer time gives a more accurate speed, but the speed may have changed since. For the
// noise of our encoders and 1,000 to 80,000 rad/s2, the best time is 0.1 to 1.5 ms.
constexpr MonoNs kBetweenAnchors = kMillisecond;

bool FarApart(const UnwrappedSample& from, const UnwrappedSample& to) {
  return to.at.first - from.at.last >= kBetweenAnchors;
}

constexpr std::int64_t kTolerancesPerTurn = 3'600;  // 0.1 degrees
constexpr std::int64_t kMinTolerance = 2;
constexpr MonoNs kSpeedStep = 5 * kMillisecond;

}  // namespace

MotionLimits::MotionLimits(std::int64_t counts_per_turn, double speed_rpm, double accel_rad_s2,
                           std::int64_t noise_counts)
    : speed_(std::numeric_limits<double>::infinity()),
      acceleration_(std::numeric_limits<double>::infinity()),
      error_(static_cast<double>(noise_counts) + 1),
      low_accuracy_(static_cast<double>(counts_per_turn) / kLowAccuracySteps) {
  const auto turn = static_cast<double>(counts_per_turn);
  if (speed_rpm > 0) speed_ = speed_rpm * turn / kNsPerMinute;
  if (accel_rad_s2 > 0) {
    acceleration_ = accel_rad_s2 / (2 * std::numbers::pi) * turn / (kNsPerSecond * kNsPerSecond);
  }
}

MotionLimits::MotionLimits(const DeviceConfig& device)
    : MotionLimits(device.settings->counts_per_turn,
                   device.speed_rpm > 0 ? device.speed_rpm : device.settings->max_speed_rpm,
                   device.accel_rad_s2 > 0 ? device.accel_rad_s2 : device.settings->max_accel_rad_s2,
                   device.settings->noise_counts) {}

double MotionLimits::Error(const UnwrappedSample& a, const UnwrappedSample& b) const {
  return error_ + (a.low_accuracy ? low_accuracy_ : 0) + (b.low_accuracy ? low_accuracy_ : 0);
}

double MotionLimits::Reach(const UnwrappedSample& from, const UnwrappedSample& to) const {
  const MonoNs longest = std::max<MonoNs>(to.at.last - from.at.first, 1);
  return speed_ * static_cast<double>(longest) + Error(from, to);
}

bool MotionLimits::SpeedAllows(const UnwrappedSample& from, const UnwrappedSample& to) const {
  return std::abs(static_cast<double>(to.counts - from.counts)) <= Reach(from, to);
}

bool MotionLimits::AccelerationAllows(const UnwrappedSample& a, const UnwrappedSample& b,
                                      const UnwrappedSample& c) const {
  const MonoNs shortest_1 = b.at.first - a.at.last;
  const MonoNs shortest_2 = c.at.first - b.at.last;
  if (shortest_1 <= 0 || shortest_2 <= 0) return true;
  const auto longest_1 = static_cast<double>(b.at.last - a.at.first);
  const auto longest_2 = static_cast<double>(c.at.last - b.at.first);
  const SpeedRange before =
      MeanSpeed(static_cast<double>(b.counts - a.counts), Error(a, b), static_cast<double>(shortest_1), longest_1);
  const SpeedRange after =
      MeanSpeed(static_cast<double>(c.counts - b.counts), Error(b, c), static_cast<double>(shortest_2), longest_2);
  // The mean speeds of two adjacent intervals differ by at most acceleration x the time between their middles.
  const double change = std::max({0.0, after.minimum - before.maximum, before.minimum - after.maximum});
  return change <= acceleration_ * (longest_1 + longest_2) / 2;
}

TurnCounter::TurnCounter(const DeviceConfig& device, const MotionLimits& limits)
    : limits_(limits),
      counts_per_turn_(device.settings->counts_per_turn),
      turns_range_(device.settings->turns_range),
      period_(counts_per_turn_ * std::max<std::int64_t>(turns_range_, 1)),
      mode_(device.turns) {}

std::int64_t TurnCounter::CountsOf(const Sample& sample) const {
  const std::int64_t turns = HoldsTurns(sample) ? FloorMod(sample.turns, turns_range_) : 0;
  return turns * counts_per_turn_ + FloorMod(sample.counts, counts_per_turn_);
}

std::int64_t TurnCounter::WithinEnds(std::int64_t counts, std::int64_t period) const {
  return mode_ == TurnsMode::kSigned ? Nearest(counts, period, 0) : FloorMod(counts, period);
}

UnwrappedSample TurnCounter::First(const Sample& sample, std::optional<std::int64_t> origin) const {
  const std::int64_t period = has_counter() && !sample.has_turns ? counts_per_turn_ : period_;
  const std::int64_t counts = CountsOf(sample);
  const bool near_origin = mode_ == TurnsMode::kModulo && origin.has_value();
  return {near_origin ? Nearest(counts, period, *origin) : WithinEnds(counts, period), sample.at,
          sample.low_accuracy};
}

TurnCounter::Unwrapped TurnCounter::Follow(const UnwrappedSample& from, const Sample& sample) const {
  if (!has_counter()) return Nearer(from, sample, period_, true);
  if (aligned_ && sample.has_turns) {
    const Unwrapped by_counter = Nearer(from, sample, period_, true);
    if (sample.turns_trusted || limits_.SpeedAllows(from, by_counter.sample)) return by_counter;
  }
  return Nearer(from, sample, counts_per_turn_, false);
}

TurnCounter::Unwrapped TurnCounter::Nearer(const UnwrappedSample& from, const Sample& sample, std::int64_t period,
                                           bool whole) const {
  Unwrapped unwrapped{.sample = {0, sample.at, sample.low_accuracy}, .by_counter = whole && has_counter()};
  unwrapped.continuous = limits_.Reach(from, unwrapped.sample) < static_cast<double>(period) / 2;
  const bool by_ends = !unwrapped.continuous && whole && mode_ != TurnsMode::kModulo;
  const std::int64_t counts = CountsOf(sample);
  unwrapped.sample.counts = by_ends ? WithinEnds(counts, period) : Nearest(counts, period, from.counts);
  return unwrapped;
}

void TurnCounter::Begin(const Sample& sample, bool sure) {
  trusted_ = sample.turns_trusted;
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
    if (trusted_) sure_ = false;
    trusted_ = false;
  } else if (sample.has_turns) {
    trusted_ = true;
    if (unwrapped.by_counter) sure_ = true;
  }
  if (!unwrapped.by_counter && !unwrapped.continuous) {
    aligned_ = false;
    sure_ = false;
    change.lost_turns = change.was_sure && !trusted_;
  }
  if (!aligned_ && sample.has_turns && sample.turns_trusted) change.correction = Align(unwrapped, sample);
  return change;
}

std::int64_t TurnCounter::Align(const Unwrapped& unwrapped, const Sample& sample) {
  const std::int64_t contradiction =
      Nearest(CountsOf(sample), period_, unwrapped.sample.counts) - unwrapped.sample.counts;
  contradictions_ = contradictions_ > 0 && contradiction == contradiction_ ? contradictions_ + 1 : 1;
  contradiction_ = contradiction;
  if (contradiction != 0 && contradictions_ < kContradictionsToAccept) return 0;
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

bool Plausibility::Agrees(const UnwrappedSample& sample) const {
  return limits_.SpeedAllows(last_, sample) && AccelerationAllows(sample);
}

bool Plausibility::AccelerationAllows(const UnwrappedSample& sample) const {
  if (has_before_ && !limits_.AccelerationAllows(before_, last_, sample)) return false;
  for (std::size_t i = 0; i < anchor_count_; ++i) {
    if (!limits_.AccelerationAllows(anchors_[i], last_, sample)) return false;
  }
  if (anchor_count_ == 0) return true;
  const std::size_t newest = FarApart(anchors_[0], sample) ? 0 : 1;
  if (newest + 1 >= anchor_count_) return true;
  return limits_.AccelerationAllows(anchors_[newest + 1], anchors_[newest], sample);
}

void Plausibility::Accept(const UnwrappedSample& sample, bool continuous) {
  has_before_ = known_ && continuous;
  before_ = last_;
  if (!continuous) anchor_count_ = 0;
  last_ = sample;
  known_ = true;
  run_ = 0;
  if (anchor_count_ == 0 || FarApart(anchors_[0], sample)) PushAnchor(sample);
}

void Plausibility::PushAnchor(const UnwrappedSample& sample) {
  anchors_[2] = anchors_[1];
  anchors_[1] = anchors_[0];
  anchors_[0] = sample;
  anchor_count_ = std::min(anchor_count_ + 1, anchors_.size());
}

Plausibility::Doubt Plausibility::TakeDoubtful(const UnwrappedSample& sample) {
  // A jump from 5 bits to full resolution is expected (TS5669 spec 6.4, FS).
  if (known_ && last_.low_accuracy && !sample.low_accuracy) Forget();

  const bool first = run_ == 0;
  run_ = !first && limits_.SpeedAllows(doubted_, sample) ? run_ + 1 : 1;
  doubted_ = sample;
  if (!known_) {
    if (run_ < kRunToBegin) return first ? Doubt::kFirst : Doubt::kImplausible;
    Accept(sample, false);
    return Doubt::kAcceptedAtStart;
  }
  if (hold_ || run_ < confirmations_) return Doubt::kImplausible;
  const bool repaired = has_before_ && limits_.SpeedAllows(before_, sample);
  Accept(sample, false);
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

void Speed::Add(const UnwrappedSample& sample) {
  last_ = sample;
  if (size_ > 0 && sample.at.Middle() - Back(0).at.Middle() < kSpacing) return;
  newest_ = (newest_ + 1) % kSize;
  ring_[newest_] = sample;
  size_ = std::min(size_ + 1, kSize);
}

bool Speed::Known(std::size_t used) const {
  if (used < 2) return false;
  const UnwrappedSample& oldest = Back(used - 1);
  const MonoNs span = last_.at.Middle() - oldest.at.Middle();
  return span >= kShortest && (last_.at.HalfWidth() + oldest.at.HalfWidth()) * 4 <= span;
}

std::size_t Speed::Used() const {
  std::size_t used = 0;
  while (used < size_) {
    const MonoNs age = last_.at.Middle() - Back(used).at.Middle();
    if (age > kLongest || (age > kWindow && Known(used))) break;
    ++used;
  }
  return used;
}

double Speed::CountsPerSecond() const {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const std::size_t used = Used();
  if (!Known(used)) return kUnknown;
  // Least squares relative to the last reading, which is used even if it is not in the ring.
  double n = 0;
  double t_sum = 0;
  double x_sum = 0;
  double tt_sum = 0;
  double tx_sum = 0;
  const auto add = [&](const UnwrappedSample& sample) {
    const double t = static_cast<double>(sample.at.Middle() - last_.at.Middle());
    const double x = static_cast<double>(sample.counts - last_.counts);
    n += 1;
    t_sum += t;
    x_sum += x;
    tt_sum += t * t;
    tx_sum += t * x;
  };
  if (Back(0).at.Middle() != last_.at.Middle()) add(last_);
  for (std::size_t i = 0; i < used; ++i) add(Back(i));
  return (n * tx_sum - t_sum * x_sum) / (n * tt_sum - t_sum * t_sum) * static_cast<double>(kSecond);
}

Standstill::Standstill(std::int64_t counts_per_turn, std::int64_t noise_counts)
    : counts_per_turn_(counts_per_turn),
      tolerance_(2 * noise_counts + std::max(kMinTolerance, counts_per_turn / kTolerancesPerTurn)) {}

void Standstill::BeginWatch(const UnwrappedSample& sample) {
  any_ = true;
  moved_ = false;
  watched_since_ = sample.at.Middle();
  interval_since_ = sample.at.Middle();
  step_from_ = sample;
  fastest_ = 0;
  fastest_before_ = 0;
  BeginWindow(sample);
}

void Standstill::BeginWindow(const UnwrappedSample& sample) {
  since_ = sample.at.Middle();
  lowest_ = sample.counts;
  highest_ = sample.counts;
  established_ = false;
}

void Standstill::Add(const UnwrappedSample& sample, bool continuous) {
  if (!any_ || sample.at.first - last_.at.last > kOldest) {
    BeginWatch(sample);
  } else {
    Extend(sample, continuous);
    MeasureSpeed(sample);
  }
  last_ = sample;
}

void Standstill::Extend(const UnwrappedSample& sample, bool continuous) {
  const std::int64_t minimum = std::min(lowest_, sample.counts);
  const std::int64_t maximum = std::max(highest_, sample.counts);
  const bool moved = maximum - minimum > tolerance_;
  moved_ = moved_ || moved;
  if (moved || (!continuous && !established_)) {
    BeginWindow(sample);
    return;
  }
  lowest_ = minimum;
  highest_ = maximum;
  if (sample.at.Middle() - since_ >= kCover) established_ = true;
}

void Standstill::MeasureSpeed(const UnwrappedSample& sample) {
  const MonoNs step = sample.at.Middle() - step_from_.at.Middle();
  if (step < kSpeedStep) return;
  if (sample.at.Middle() - interval_since_ >= kCover) {
    fastest_before_ = fastest_;
    fastest_ = 0;
    interval_since_ = sample.at.Middle();
  }
  const double distance = std::abs(static_cast<double>(sample.counts - step_from_.counts));
  fastest_ = std::max(fastest_, distance / static_cast<double>(step));
  step_from_ = sample;
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
