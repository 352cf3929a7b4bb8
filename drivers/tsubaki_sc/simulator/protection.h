#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
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
[[nodiscard]] Record RecordOf(const GearMotor::Reading& reading);

// What the unit retains to have the time before a trip: one record each GearMotor::kStep.
class History {
 public:
  void Add(const Record& record);
  void ReplaceNewest(const Record& record);
  void Clear() { size_ = 0; }
  // `steps` before the newest; all 0 before the time that is retained.
  [[nodiscard]] Record Before(std::size_t steps) const;

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
  void Shift(std::uint16_t factor, const History& history, std::uint16_t interval);

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
[[nodiscard]] std::string CauseText(std::uint16_t bits);

// What the motor is judged by, as the registers hold it.
struct Limits {
  std::array<std::uint16_t, 4> power{};       // 0.1 W: upper A, upper B, lower A, lower B; 0: not judged
  std::uint16_t start_time = 1;               // 0.1 s
  std::array<std::uint16_t, 4> shock_time{};  // 0.1 s, of each power limit
  std::uint16_t overheat = 0;                 // 0.1 C; 0: not judged
  std::uint16_t excessive_shock = 0;          // 0.01 m/s^2; 0: not judged
};

// Decides when a running motor trips. What the guideline leaves open: a value trips beyond its limit, not at it; power
// is not judged during the start time; beyond a power limit for its shock time without a break trips; the largest of
// the three axes is judged.
class Protection {
 public:
  // Of a motor that has started.
  void Begin(MonoNs now);
  // The causes to trip now, 0 for none.
  [[nodiscard]] std::uint16_t Judge(const Record& record, const Limits& limits, MonoNs now);

 private:
  [[nodiscard]] std::uint16_t JudgePower(std::uint16_t power, const Limits& limits, MonoNs now);

  MonoNs begun_ = 0;
  std::array<MonoNs, 4> beyond_since_{};
};

}  // namespace axlecast::tsubaki_sc::simulator
