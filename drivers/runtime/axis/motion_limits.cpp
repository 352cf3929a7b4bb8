#include "drivers/runtime/axis/motion_limits.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace axlecast {
namespace {

constexpr double kNsPerSecond = 1e9;
constexpr double kNsPerMinute = 60e9;
constexpr std::int64_t kLowAccuracySteps = 32;  // 5 bits

// The mean speed that a stretch may have had, in counts per ns.
struct SpeedRange {
  double minimum;
  double maximum;
};

SpeedRange MeanSpeed(double distance, double error, double shortest, double longest) {
  const double low = distance - error;
  const double high = distance + error;
  return {low / (low >= 0 ? longest : shortest), high / (high >= 0 ? shortest : longest)};
}

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
  // Mean speeds of two adjoining stretches differ by at most acceleration x the distance of their middles.
  const double change = std::max({0.0, after.minimum - before.maximum, before.minimum - after.maximum});
  return change <= acceleration_ * (longest_1 + longest_2) / 2;
}

}  // namespace axlecast
