#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "drivers/tsubaki_sc/simulator/gear_motor.h"

namespace axlecast::tsubaki_sc::simulator {

// The seven quantities at one instant as input registers 100-106 hold them: voltage 0.1 V, current mA, power 0.1 W,
// temperature 0.1 C and acceleration x, y, z 0.01 m/s^2, the last four signed (guideline 10).
using Record = std::array<std::uint16_t, 7>;
inline constexpr std::size_t kPowerIndex = 2;
inline constexpr std::size_t kTemperatureIndex = 3;
inline constexpr std::size_t kAccelIndex = 4;
[[nodiscard]] inline Record RecordOf(const GearMotor::Reading& reading) {
  const auto raw = [](double value, double min, double max) {
    return static_cast<std::uint16_t>(static_cast<int>(std::clamp(std::round(value), min, max)));
  };
  const auto as_unsigned = [&](double value) { return raw(value, 0, 65535); };
  const auto as_signed = [&](double value) { return raw(value, -32768, 32767); };
  Record record{as_unsigned(reading.voltage_v * 10), as_unsigned(reading.current_a * 1000),
                as_unsigned(reading.power_w * 10), as_signed(reading.temperature_c * 10)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    record.at(kAccelIndex + axis) = as_signed(reading.accel_mps2.at(axis) * 100);
  }
  return record;
}
// The unit of all times.
inline constexpr MonoNs kTick = 100 * kMillisecond;
inline constexpr auto kStepsPerTick = static_cast<std::size_t>(kTick / GearMotor::kStep);

// The records before a trip that the unit retains: one each GearMotor::kStep.
class History {
 public:
  void Add(const Record& record) {
    ring_.resize(kSize);
    ring_[next_] = record;
    next_ = (next_ + 1) % kSize;
    size_ = std::min(size_ + 1, kSize);
  }
  void ReplaceNewest(const Record& record) {
    if (size_ == 0) return Add(record);
    ring_[(next_ + kSize - 1) % kSize] = record;
  }
  void Clear() { size_ = 0; }
  // Returns the record `steps` before the newest; all 0 before the time that is retained.
  [[nodiscard]] Record Before(std::size_t steps) const {
    if (steps >= size_) return {};
    return ring_[(next_ + kSize - 1 - steps) % kSize];
  }

 private:
  static constexpr std::size_t kSize = 19 * 100 * 10 + 1;  // 19 x the longest log acquisition time (100 x 0.1 s)

  std::vector<Record> ring_;
  std::size_t next_ = 0;
  std::size_t size_ = 0;
};

// The last three trips, newest first.
class TripLogs {
 public:
  static constexpr std::size_t kLogs = 3;
  static constexpr std::size_t kSamples = 20;  // oldest first, the last at the trip

  // The newest record of `history` is that of the trip; `interval` is the log acquisition time, 0.1 s.
  void Shift(std::uint16_t factor, const History& history, std::uint16_t interval) {
    std::copy_backward(logs_.begin(), logs_.end() - 1, logs_.end());
    Log& newest = logs_.front();
    newest.factor = factor;
    for (std::size_t i = 0; i < kSamples; ++i) {
      newest.samples[i] = history.Before((kSamples - 1 - i) * interval * kStepsPerTick);
    }
  }

  [[nodiscard]] std::uint16_t factor(std::size_t log) const { return logs_.at(log).factor; }
  [[nodiscard]] std::uint16_t sample(std::size_t log, std::size_t quantity, std::size_t index) const {
    return logs_.at(log).samples.at(index).at(quantity);
  }

 private:
  struct Log {
    std::uint16_t factor = 0;
    std::array<Record, kSamples> samples{};
  };
  std::array<Log, kLogs> logs_{};
};

// Bits of the motor status and of the trip factors, guideline 10, note 1. The first four in the order of the SET
// parameters 0-3 and 5-8.
inline constexpr std::uint16_t kUpperA = 1U << 0U;
inline constexpr std::uint16_t kUpperB = 1U << 1U;
inline constexpr std::uint16_t kLowerA = 1U << 2U;
inline constexpr std::uint16_t kLowerB = 1U << 3U;
inline constexpr std::uint16_t kOverheat = 1U << 5U;
inline constexpr std::uint16_t kExcessiveShock = 1U << 6U;

struct Cause {
  std::string_view name;
  std::uint16_t bit;
};
inline constexpr std::array<Cause, 6> kCauses = {{{"power_upper_a", kUpperA},
                                                  {"power_upper_b", kUpperB},
                                                  {"power_lower_a", kLowerA},
                                                  {"power_lower_b", kLowerB},
                                                  {"overheat", kOverheat},
                                                  {"excessive_shock", kExcessiveShock}}};
// "power_upper_a power_upper_b", or "none".
[[nodiscard]] inline std::string CauseText(std::uint16_t bits) {
  std::string text;
  for (const Cause& cause : kCauses) {
    if ((bits & cause.bit) != 0) text += (text.empty() ? "" : " ") + std::string(cause.name);
  }
  return text.empty() ? "none" : text;
}

// The limits of the motor, as the registers hold them.
struct Limits {
  std::array<std::uint16_t, 4> power{};       // 0.1 W: upper A, upper B, lower A, lower B; 0: no limit
  std::uint16_t start_time = 1;               // 0.1 s
  std::array<std::uint16_t, 4> shock_time{};  // 0.1 s, of each power limit
  std::uint16_t overheat = 0;                 // 0.1 C; 0: no limit
  std::uint16_t excessive_shock = 0;          // 0.01 m/s^2; 0: no limit
};

// Decides when a running motor trips. The guideline does not define these rules: a value trips beyond its limit, not at
// it. Power limits do not apply during the start time. Power trips if it stays beyond a limit for the limit's shock time.
// The largest of the three axes counts.
class Protection {
 public:
  // The motor has started.
  void Begin(MonoNs now) {
    begun_ = now;
    beyond_since_.fill(kNever);
  }
  // Returns the causes to trip now, 0 for none.
  [[nodiscard]] std::uint16_t Causes(const Record& record, const Limits& limits, MonoNs now) {
    unsigned causes = PowerCauses(record[kPowerIndex], limits, now);
    if (limits.overheat != 0 && static_cast<std::int16_t>(record[kTemperatureIndex]) > limits.overheat)
      causes |= kOverheat;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int accel = std::abs(static_cast<std::int16_t>(record[kAccelIndex + axis]));
      if (limits.excessive_shock != 0 && accel > limits.excessive_shock) causes |= kExcessiveShock;
    }
    return static_cast<std::uint16_t>(causes);
  }

 private:
  [[nodiscard]] std::uint16_t PowerCauses(std::uint16_t power, const Limits& limits, MonoNs now) {
    const bool starting = now - begun_ < limits.start_time * kTick;
    unsigned causes = 0;
    for (std::size_t i = 0; i < limits.power.size(); ++i) {
      const std::uint16_t limit = limits.power[i];
      const bool beyond = limit != 0 && (i < 2 ? power > limit : power < limit);
      if (starting || !beyond) {
        beyond_since_[i] = kNever;
        continue;
      }
      beyond_since_[i] = std::min(beyond_since_[i], now);
      if (now - beyond_since_[i] >= limits.shock_time[i] * kTick) causes |= 1U << i;
    }
    return static_cast<std::uint16_t>(causes);
  }

  MonoNs begun_ = 0;
  std::array<MonoNs, 4> beyond_since_{};
};

}  // namespace axlecast::tsubaki_sc::simulator
