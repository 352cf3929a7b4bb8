#pragma once

#include <array>
#include <axlecast/trip_log_t.hpp>

#include "core/device/family.h"

namespace axlecast {

// A family with three settings, at registers 0, 1 and 5; for tests.
inline const Family& ParameterFamily() {
  static constexpr std::array<ParameterSpec, 3> kParameters = {
      ParameterSpec{"power_limit", 0, "W", 1, 0, 10'000, true, "power limit; 0: no trip"},
      ParameterSpec{"start_time", 1, "s", 1, 1, 50, false, "time after the start without trips"},
      ParameterSpec{"shock_limit", 5, "m/s2", 2, 0, 15'000, true, "acceleration at which it trips"}};
  static const Family family = [] {
    Family made;
    made.name = "made_up";
    made.has_position = false;
    made.parameters = kParameters;
    return made;
  }();
  return family;
}

// Trip 5 by power upper A, a sample each 0.1 s; the power of sample n is 100 + 10 n W. For tests.
inline trip_log_t TripLog() {
  trip_log_t trip{};
  trip.device = "gm3";
  trip.log_index = 1;
  trip.trip_count = 5;
  trip.factor_bits = 1;
  trip.not_before_utime = 1'795'244'401'000'000;  // 2026-11-21 07:00:01 UTC
  trip.not_after_utime = 1'795'244'405'500'000;
  trip.interval_us = 100'000;
  trip.valid_mask = 0x7F;
  for (int sample = 0; sample < 20; ++sample) {
    trip.samples[0][sample] = 230.5F;
    trip.samples[1][sample] = 0.5F;
    trip.samples[2][sample] = 100.0F + 10.0F * static_cast<float>(sample);
    trip.samples[3][sample] = 45.0F;
    trip.samples[6][sample] = 9.81F;
  }
  return trip;
}

}  // namespace axlecast
