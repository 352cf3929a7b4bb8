#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/base/time.h"

namespace axlecast {

inline constexpr float kUnknownQuantity = std::numeric_limits<float>::quiet_NaN();

// What a motor monitor says of its motor, in SI units: the content of motor_health_t. The two halves are read one
// after the other, so each has its own instant; a half whose interval is {0, 0} was never read.
struct MotorReading {
  Interval analog_at;  // holds the instant of the quantities
  float voltage_v = kUnknownQuantity;
  float current_a = kUnknownQuantity;
  float power_w = kUnknownQuantity;
  float temperature_c = kUnknownQuantity;
  std::array<float, 3> accel_mps2{kUnknownQuantity, kUnknownQuantity, kUnknownQuantity};

  Interval status_at;  // holds the instant of what follows
  std::int32_t trip_count = 0;
  std::int32_t status_bits = 0;
  std::array<std::int32_t, 3> trip_factor{};  // newest first
  bool tripped = false;

  std::int8_t stop_coil = -1;  // 1, 0, -1 unknown
  std::int8_t logged_in = -1;  // 1, 0, -1 unknown
  std::int8_t mains_hz = 0;    // 50, 60, 0 unknown

  [[nodiscard]] bool has_analog() const { return analog_at.last != 0; }
  [[nodiscard]] bool has_status() const { return status_at.last != 0; }
};

// What trips a motor, as its monitor keeps it, in SI units: the content of motor_limits_t. A limit of 0 never trips.
struct MotorLimits {
  static constexpr std::size_t kParameters = 55;

  Interval at;  // of the newest register that was read
  // In force at the present switch setting and mains frequency.
  std::array<float, 2> power_upper_w{kUnknownQuantity, kUnknownQuantity};  // A, B
  std::array<float, 2> power_lower_w{kUnknownQuantity, kUnknownQuantity};
  float start_time_s = kUnknownQuantity;
  std::array<float, 2> shock_time_upper_s{kUnknownQuantity, kUnknownQuantity};
  std::array<float, 2> shock_time_lower_s{kUnknownQuantity, kUnknownQuantity};
  float overheat_c = kUnknownQuantity;
  float shock_mps2 = kUnknownQuantity;
  float log_interval_s = kUnknownQuantity;
  std::array<float, kParameters> parameters{};  // all that the device keeps, in the order of its registers

  MotorLimits() { parameters.fill(kUnknownQuantity); }
};

// One trip with its recorded curves: the content of trip_log_t.
struct TripRecord {
  static constexpr std::size_t kQuantities = 7;  // V, A, W, degrees C, m/s^2 x y z
  static constexpr std::size_t kSamples = 20;    // oldest first, the last is the trip

  Interval at;  // first and last read of the log
  std::int8_t log_index = 1;
  std::int32_t trip_count = 0;
  std::int32_t factor_bits = 0;
  MonoNs not_before = 0;  // the trip happened after it; 0 unknown
  MonoNs not_after = 0;   // and before it; 0 unknown
  std::int32_t interval_us = 0;
  std::uint8_t valid_mask = 0;  // bit q: samples[q] was read
  std::array<std::array<float, kSamples>, kQuantities> samples{};
};

}  // namespace axlecast
