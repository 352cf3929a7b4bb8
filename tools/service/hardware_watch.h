#pragma once

#include <axlecast/alarm_entry_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/config/machine_config.h"
#include "tools/service/acceptance_result.h"

namespace axlecast {

// The fastest motion of an axis while its positions are watched, and the `limits` that follow from it. Pure.
//
// Speeds are means over 20 ms or more, so that the noise of two readings does not look like motion, and accelerations
// are their changes. Both come out too low rather than too high for motions shorter than that: the margin is for those.
class MotionWatch {
 public:
  // A valid position.
  void On(const position_t& position);

  [[nodiscard]] double speed_rpm() const { return speed_rpm_; }        // the fastest so far
  [[nodiscard]] double accel_rad_s2() const { return accel_rad_s2_; }  // likewise

  // What was seen, beside the limits of the device: of its own, or of its model only.
  [[nodiscard]] FindingGroup Judge(const DeviceConfig& device) const;

  static constexpr double kSpeedMargin = 1.5;
  static constexpr double kAccelMargin = 2;

 private:
  struct Stretch {
    double seconds = 0;
    double rad_s = 0;
  };

  double speed_rpm_ = 0;
  double accel_rad_s2_ = 0;
  std::optional<position_t> begin_;  // of the stretch under way
  std::optional<Stretch> before_;    // the one that ended there
};

// A proposed limit: rounded up to two digits; `most`, the model's, where that is less; 0: the model has none.
[[nodiscard]] double ProposedLimit(double seen, double margin, double maximum);

// One device and its bus over a stretch of time, as their messages tell, judged for an acceptance. Pure.
class HardwareWatch {
 public:
  HardwareWatch(const BusConfig& bus, const DeviceConfig& device) : bus_config_(bus), device_(device) {}

  void OnMessage(std::string_view channel, Bytes message);
  // DEVICE and BUS have come at least twice.
  [[nodiscard]] bool Heard() const { return infos_ >= 2 && buses_ >= 2; }
  [[nodiscard]] std::int64_t readings() const;  // good ones, since the watch began
  [[nodiscard]] std::int64_t errors() const;    // failed ones
  [[nodiscard]] const std::optional<position_t>& position() const { return position_; }  // the newest valid one
  [[nodiscard]] const std::optional<device_info_t>& info() const { return info_; }

  [[nodiscard]] Findings Judge() const;

 private:
  void JudgeIdentity(Findings& findings) const;
  void JudgeReadings(Findings& findings) const;
  [[nodiscard]] std::string WhyNoReading() const;
  void JudgeBus(Findings& findings) const;
  void JudgeAlarms(Findings& findings) const;

  const BusConfig& bus_config_;
  const DeviceConfig& device_;
  int infos_ = 0;
  int buses_ = 0;
  std::optional<device_info_t> first_info_;
  std::optional<device_info_t> info_;
  std::optional<bus_health_t> first_bus_;
  std::optional<bus_health_t> bus_;
  std::optional<position_t> position_;
  std::int64_t positions_ = 0;
  std::int64_t not_valid_ = 0;
  MotionWatch motion_;
  float fastest_us_ = 0;  // of all windows; 0: none yet
  float slowest_p99_us_ = 0;
  std::vector<float> p50_us_;  // of each window
  std::vector<alarm_entry_t> alarms_;
  bool alarms_heard_ = false;
};

// What to do about failed readings of this kind (device_info_t ERROR_*) on a bus of this family. `some_good`: other readings
// of the same time were good, so that wiring and settings are not all wrong. `family` may be null: a serial line.
[[nodiscard]] std::string ErrorAdvice(std::size_t kind, const Family* family, bool some_good);

// A shaft that was turned by hand once: `turns` in the device's direction.
[[nodiscard]] AcceptanceResult JudgeRotation(double turns, std::int8_t direction);

}  // namespace axlecast
