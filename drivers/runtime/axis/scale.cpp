#include "drivers/runtime/axis/scale.h"

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "drivers/runtime/axis/counts.h"

namespace axlecast {
namespace {

constexpr double kMaxCounts = 4503599627370496.0;      // 2^52
constexpr double kMaxProduct = 4611686018427387904.0;  // 2^62
constexpr double kWholeTolerance = 1e-9;

// The modulo in counts x |num|, where that is a whole number and the product below cannot overflow; else 0.
std::int64_t ExactPeriod(const DeviceConfig& device) {
  const double period = device.modulo / device.per_turn * static_cast<double>(device.ratio_den) *
                        static_cast<double>(device.settings->counts_per_turn);
  const bool whole = period >= 1 && period <= kMaxCounts && period == std::round(period);
  const double num = std::abs(static_cast<double>(device.ratio_num));
  return whole && period * num < kMaxProduct ? static_cast<std::int64_t>(period) : 0;
}

}  // namespace

Scale::Scale(const DeviceConfig& device)
    : counts_per_turn_(device.settings->counts_per_turn),
      ratio_num_(device.ratio_num),
      unit_per_count_(
          device.per_turn * static_cast<double>(device.ratio_num) /
          (static_cast<double>(device.ratio_den) * static_cast<double>(device.settings->counts_per_turn))),
      modulo_(device.modulo),
      unit_per_shaft_turn_(device.per_turn * static_cast<double>(device.ratio_num) /
                           static_cast<double>(device.ratio_den)),
      exact_period_(device.modulo > 0 ? ExactPeriod(device) : 0) {}

double Scale::AngleRad(std::int64_t counts) const {
  return static_cast<double>(FloorMod(counts, counts_per_turn_)) / static_cast<double>(counts_per_turn_) * 2 *
         std::numbers::pi;
}

double Scale::Value(std::int64_t counts) const {
  if (modulo_ <= 0) return static_cast<double>(counts) * unit_per_count_;
  double wrapped = 0;
  if (exact_period_ > 0) {
    const std::int64_t rest = FloorMod(FloorMod(counts, exact_period_) * ratio_num_, exact_period_);
    wrapped = static_cast<double>(rest) / static_cast<double>(exact_period_) * modulo_;
  } else {
    wrapped = std::fmod(static_cast<double>(counts) * unit_per_count_, modulo_);
    if (wrapped < 0) wrapped += modulo_;
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

}  // namespace axlecast
