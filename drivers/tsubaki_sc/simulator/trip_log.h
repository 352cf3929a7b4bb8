#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

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

}  // namespace axlecast::tsubaki_sc::simulator
