#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>

#include "core/base/time.h"

namespace axlecast {

// Why a reading failed: index into device_info_t.errors, the values of its ERROR_* constants.
enum class ErrorKind : std::uint8_t {
  kTimeout,
  kShort,
  kFraming,
  kChecksum,
  kWrongEcho,
  kCommunicationAlarm,
  kAbnormalReply,
  kWrongIdentity,
  kRange,
  kImplausible,
  kDevice,
  kUnexpectedBytes,
  kBusy,
  kIo,
  kException,
  kSilent,
};
inline constexpr std::size_t kErrorKinds = 16;
inline constexpr std::array<const char*, kErrorKinds> kErrorNames = {"timeout",        "short",
                                                                     "framing",        "checksum",
                                                                     "wrong_echo",     "communication_alarm",
                                                                     "abnormal_reply", "wrong_identity",
                                                                     "range",          "implausible",
                                                                     "device",         "stray",
                                                                     "busy",           "io",
                                                                     "exception",      "silent"};
[[nodiscard]] constexpr const char* ErrorName(ErrorKind kind) {
  return kErrorNames.at(static_cast<std::size_t>(kind));
}

// One decoded position as the device sent it, before plausibility, direction and datum.
struct Sample {
  Interval at;                 // contains the sampling time
  std::int64_t counts = 0;     // single-turn, [0, counts per turn)
  std::int32_t turns = 0;      // multi-turn counter as sent
  bool has_turns = false;      // this reply held the multi-turn counter
  bool turns_trusted = true;   // false: the device reports that its turns may be wrong
  bool turns_wrapped = false;  // the counter has overflowed since it was last cleared
  bool low_accuracy = false;   // reduced resolution; the jump that ends it is exempt from plausibility
  bool error = false;          // the device reports that the position is not valid
  bool warning = false;
  std::int32_t device_status = 0;  // raw
};

// Returns the remainder in [0, modulus), also for negative numbers. Numbers near the range need no division.
[[nodiscard]] constexpr std::int64_t FloorMod(std::int64_t counts, std::int64_t modulus) {
  if (counts >= 0 && counts < modulus) return counts;
  if (counts < 0 && counts >= -modulus) return counts + modulus;
  const std::int64_t rest = counts % modulus;
  return rest < 0 ? rest + modulus : rest;
}

// Returns the angle of the shaft in [0, 2 pi).
[[nodiscard]] constexpr double AngleRad(std::int64_t counts, std::int64_t counts_per_turn) {
  return static_cast<double>(FloorMod(counts, counts_per_turn)) / static_cast<double>(counts_per_turn) * 2 *
         std::numbers::pi;
}

// Returns the shaft angle of single-turn counts, in degrees.
[[nodiscard]] inline double Degrees(std::int64_t counts, int single_turn_bits) {
  return static_cast<double>(counts) * 360 / static_cast<double>(std::int64_t{1} << single_turn_bits);
}

// Returns the shortest distance between two single-turn positions, in counts.
[[nodiscard]] inline std::int64_t CircularDistance(std::int64_t a, std::int64_t b, std::int64_t counts_per_turn) {
  const std::int64_t forward = ((a - b) % counts_per_turn + counts_per_turn) % counts_per_turn;
  return std::min(forward, counts_per_turn - forward);
}

inline constexpr float kUnknownQuantity = std::numeric_limits<float>::quiet_NaN();

// A reading of a motor monitor in SI units: the content of motor_health_t. The two halves are read one after the other, so
// each has its own time. A half whose interval is {0, 0} was never read.
struct MotorReading {
  Interval analog_at;  // contains the time of the quantities
  float voltage_v = kUnknownQuantity;
  float current_a = kUnknownQuantity;
  float power_w = kUnknownQuantity;
  float temperature_c = kUnknownQuantity;
  std::array<float, 3> accel_mps2{kUnknownQuantity, kUnknownQuantity, kUnknownQuantity};

  Interval status_at;  // contains the time of the following fields
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

// The limits at which a monitor trips its motor, in SI units: the content of motor_limits_t. A limit of 0 never trips.
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
