#pragma once

#include <cmath>

#include "core/base/time.h"

namespace axlecast {

// Turns of a shaft that turns within its model's limits, through all positions alike: up to 68 turns a second, 4,060
// rpm, and 2,040 rad/s2. With kRealSwing: 2,720 rpm and 770 rad/s2, within the limits below.
constexpr double kModelSwing = 4.0;
constexpr double kRealSwing = 1.5;
[[nodiscard]] inline double SweepTurns(MonoNs at, double swing = kModelSwing) {
  const double t = static_cast<double>(at) * 1e-9;
  return 31.7 * t + swing * std::sin(t * 9.0);
}

// Of a real axis, as its machine's file has them.
constexpr double kRealRpm = 3'000;
constexpr const char* kRealLimits = "limits: {speed_rpm: 3000, accel_rad_s2: 1000}";

}  // namespace axlecast
