#include "drivers/runtime/axis/axis.h"

#include <algorithm>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace axlecast {
namespace {

constexpr double kMaxCounts = 4503599627370496.0;      // 2^52
constexpr double kMaxProduct = 4611686018427387904.0;  // 2^62
constexpr double kWholeTolerance = 1e-9;

// Returns the modulo in counts x |num| if it is a whole number and the product below cannot overflow; else 0.
std::int64_t ExactPeriod(const DeviceConfig& device) {
  const double period = device.modulo / device.per_turn * static_cast<double>(device.ratio_den) *
                        static_cast<double>(device.settings->counts_per_turn);
  const bool whole = period >= 1 && period <= kMaxCounts && period == std::round(period);
  const double num = std::abs(static_cast<double>(device.ratio_num));
  return whole && period * num < kMaxProduct ? static_cast<std::int64_t>(period) : 0;
}

// A datum beyond this is limited: no axis has so many counts, and sums with it do not overflow.
constexpr std::int64_t kMaxDatum = INT64_C(1) << 60;

}  // namespace

Scale::Scale(const DeviceConfig& device)
    : counts_per_turn_(device.settings->counts_per_turn),
      ratio_num_(device.ratio_num),
      unit_per_count_(UnitPerCount(device)),
      modulo_(device.modulo),
      unit_per_shaft_turn_(device.per_turn * static_cast<double>(device.ratio_num) /
                           static_cast<double>(device.ratio_den)),
      exact_period_(device.modulo > 0 ? ExactPeriod(device) : 0) {}

double Scale::AngleRad(std::int64_t counts) const { return axlecast::AngleRad(counts, counts_per_turn_); }

double Scale::Value(std::int64_t counts) const {
  if (modulo_ <= 0) return static_cast<double>(counts) * unit_per_count_;
  double wrapped = 0;
  if (exact_period_ > 0) {
    const std::int64_t rest = FloorMod(FloorMod(counts, exact_period_) * ratio_num_, exact_period_);
    wrapped = static_cast<double>(rest) / static_cast<double>(exact_period_) * modulo_;
  } else {
    wrapped = std::fmod(static_cast<double>(counts) * unit_per_count_, modulo_);
    if (std::signbit(wrapped)) wrapped += modulo_;  // also of -0
  }
  return wrapped < modulo_ ? wrapped : 0;
}

std::optional<std::int64_t> Scale::Counts(double value) const {
  const double counts = value / unit_per_count_;
  if (!std::isfinite(counts) || std::abs(counts) > kMaxCounts) return std::nullopt;
  return std::llround(counts);
}

bool Scale::TurnsMatter() const {
  if (modulo_ <= 0) return true;
  const double moduli = unit_per_shaft_turn_ / modulo_;
  return std::abs(moduli - std::round(moduli)) > kWholeTolerance || std::round(moduli) == 0;
}

Reference::Reference(const DeviceConfig& device) {
  if (device.datum_counts) of_file_ = Datum{std::clamp(*device.datum_counts, -kMaxDatum, kMaxDatum), 0};
  datum_ = of_file_;
}

bool Reference::Within(MonoNs instant, MonoNs since, MonoNs now) {
  constexpr MonoNs kLag = 2 * kSecond;
  return instant >= since && instant <= now + kLag;
}

void Reference::Set(const Datum& datum, MonoNs set_at, MonoNs now) {
  const Datum given{std::clamp(datum.counts, -kMaxDatum, kMaxDatum), datum.unix_us};
  if (lost_ && Within(set_at, lost_at_, now)) lost_ = false;
  if (datum_ == given) return;
  datum_ = given;
  Jump();
}

void Reference::Lose(MonoNs now) {
  if (!lost_) lost_at_ = now;
  lost_ = true;
}

void Reference::Clear() {
  if (!datum_ || datum_ == of_file_) return;
  DropDatum();
  Jump();
}

void Reference::DropDatum() { datum_ = of_file_; }

Axis::Axis(const DeviceConfig& device)
    : sign_(device.direction * (device.settings->ccw_increases ? 1 : -1)),
      rad_per_count_(2 * std::numbers::pi / static_cast<double>(device.settings->counts_per_turn)),
      scale_(device),
      turns_(device, MotionLimits(device)),
      plausibility_(MotionLimits(device), device.settings->confirmations_after_jump),
      reference_(device),
      standstill_(device.settings->counts_per_turn, device.settings->noise_counts),
      begins_sure_(!device.datum_counts.has_value()) {}

std::optional<std::int64_t> Axis::Origin() const {
  if (!reference_.has_datum()) return std::nullopt;
  return sign_ * reference_.datum();
}

TurnCounter::Unwrapped Axis::Unwrap(const UnwrappedSample* by, const Sample& sample) const {
  if (by != nullptr) return turns_.Follow(*by, sample);
  return {.sample = turns_.First(sample, Origin()), .continuous = false};
}

AxisReading Axis::Take(const Sample& sample) {
  const UnwrappedSample* last = plausibility_.Last();
  const TurnCounter::Unwrapped unwrapped = Unwrap(last, sample);
  if (sample.error) return Bad(sample, unwrapped.sample, position_t::FLAG_DEVICE_ERROR);
  if (last == nullptr || !plausibility_.Agrees(unwrapped.sample)) return TakeDoubtful(sample);
  Continue(unwrapped, sample);
  return Good(sample);
}

AxisReading Axis::TakeDoubtful(const Sample& sample) {
  const UnwrappedSample* doubted = plausibility_.Doubted();
  const TurnCounter::Unwrapped unwrapped = Unwrap(doubted != nullptr ? doubted : plausibility_.Last(), sample);
  switch (plausibility_.TakeDoubtful(unwrapped.sample)) {
    case Plausibility::Doubt::kFirst:
      settled_ = false;
      return {};
    case Plausibility::Doubt::kImplausible:
      return Bad(sample, unwrapped.sample, position_t::FLAG_IMPLAUSIBLE);
    case Plausibility::Doubt::kAcceptedAtStart:
      Begin(unwrapped.sample, sample);
      break;
    case Plausibility::Doubt::kAcceptedAfterJump:
      turns_.Distrust();
      CountJump(sample.at.last, true);
      Continue({unwrapped.sample, unwrapped.by_counter, false}, sample);
      break;
    case Plausibility::Doubt::kPreviousWasWrong:
      speed_.Forget();
      Continue(unwrapped, sample);
      break;
  }
  return Good(sample);
}

void Axis::Begin(const UnwrappedSample& first, const Sample& sample) {
  turns_.Begin(sample, begun_ ? turns_.sure() : begins_sure_);
  if (!begun_) counting_since_ = first.at.last;
  begun_ = true;
  Settle(first, false);
}

void Axis::Continue(const TurnCounter::Unwrapped& unwrapped, const Sample& sample) {
  const MonoNs now = sample.at.last;
  const TurnCounter::Change change = turns_.Accept(unwrapped, sample);
  if (!unwrapped.continuous) counting_since_ = now;
  if (change.lost_turns && reference_.has_datum() && scale_.TurnsMatter()) reference_.Lose(now);
  if (change.correction != 0) CountJump(now, change.was_sure);
  UnwrappedSample accepted = unwrapped.sample;
  accepted.counts += change.correction;
  Settle(accepted, unwrapped.continuous && change.correction == 0);
}

void Axis::Settle(const UnwrappedSample& good, bool continuous) {
  plausibility_.Accept(good, continuous);
  outside_ = turns_.Outside(good.counts);
  settled_ = true;
  if (!continuous || good.low_accuracy) speed_.Forget();
  if (good.low_accuracy) return;
  speed_.Add(good);
  standstill_.Add(good, continuous);
}

void Axis::CountJump(MonoNs now, bool loses_reference) {
  ++unexplained_jumps_;
  reference_.Jump();
  if (loses_reference && reference_.has_datum()) reference_.Lose(now);
  standstill_.Forget();
}

AxisReading Axis::Good(const Sample& sample) {
  AxisReading reading{AxisReading::Kind::kGood, StateFlags(sample) | position_t::FLAG_VALID,
                      Absolute(plausibility_.Last()->counts)};
  if (turns_.CountedByDriver(sample)) reading.flags |= position_t::FLAG_TURNS_COUNTED_BY_DRIVER;
  return reading;
}

AxisReading Axis::Bad(const Sample& sample, const UnwrappedSample& unwrapped, std::int32_t why) {
  settled_ = false;
  return {AxisReading::Kind::kDoubtful, (StateFlags(sample) & ~position_t::FLAG_TURNS_VALID) | why,
          Absolute(unwrapped.counts)};
}

std::int32_t Axis::StateFlags(const Sample& sample) const {
  const bool turns_valid = turns_.sure() && !reference_.lost() && !outside_ && !turns_.Ambiguous(sample);
  const bool referenced = reference_.has_datum() && !reference_.lost() && (turns_valid || !scale_.TurnsMatter());
  std::int32_t flags = 0;
  const auto set = [&](bool on, std::int32_t flag) { flags |= on ? flag : 0; };
  set(turns_valid, position_t::FLAG_TURNS_VALID);
  set(sample.turns_wrapped || outside_, position_t::FLAG_TURNS_WRAPPED);
  set(referenced, position_t::FLAG_REFERENCED);
  set(sample.low_accuracy, position_t::FLAG_LOW_ACCURACY);
  set(sample.error, position_t::FLAG_DEVICE_ERROR);
  set(sample.warning, position_t::FLAG_DEVICE_WARNING);
  set(datum_changing_, position_t::FLAG_DATUM_CHANGING);
  return flags;
}

double Axis::SpeedRadS() const { return speed_.CountsPerSecond() * static_cast<double>(sign_) * rad_per_count_; }

std::optional<std::int64_t> Axis::Counts() const {
  if (!settled_) return std::nullopt;
  return Absolute(plausibility_.Last()->counts);
}

std::optional<UnwrappedSample> Axis::LastValid() const {
  const UnwrappedSample* last = plausibility_.Last();
  if (last == nullptr) return std::nullopt;
  UnwrappedSample valid = *last;
  valid.counts *= sign_;
  return valid;
}

void Axis::SetDatum(const Reference::Datum& datum, MonoNs set_at, MonoNs now) {
  const std::int32_t epoch = reference_.epoch();
  reference_.Set(datum, set_at, now);
  if (reference_.epoch() == epoch) return;
  if (begun_ && Reference::Within(set_at, counting_since_, now)) {
    turns_.Trust();
    return;
  }
  // The datum is older than the counting: only the encoder can report how many turns the shaft is away from it.
  begins_sure_ = false;
  turns_.Distrust();
  const UnwrappedSample* last = plausibility_.Last();
  if (last == nullptr) return;
  const std::int64_t shift = turns_.NearOrigin(last->counts, *Origin()) - last->counts;
  if (shift == 0) return;
  plausibility_.Shift(shift);
  speed_.Forget();
  standstill_.Forget();
}

std::optional<std::int64_t> Axis::DatumFor(double value) const {
  const std::optional<std::int64_t> counts = Counts();
  const std::optional<std::int64_t> wanted = scale_.Counts(value);
  if (!counts || !wanted) return std::nullopt;
  return *counts + reference_.datum() - *wanted;
}

std::optional<double> Axis::ValueWith(std::int64_t datum) const {
  const std::optional<std::int64_t> counts = Counts();
  if (!counts) return std::nullopt;
  return scale_.Value(*counts + reference_.datum() - datum);
}

void Axis::OnJump() {
  reference_.DropDatum();
  reference_.Jump();
  plausibility_.Forget();
  speed_.Forget();
  standstill_.Forget();
  settled_ = false;
  begun_ = false;
  begins_sure_ = true;
}

void Axis::OnDatumChanging(bool changing) {
  datum_changing_ = changing;
  plausibility_.Hold(changing);
}

}  // namespace axlecast
