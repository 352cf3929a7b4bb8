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

// Measures the fastest motion of an axis from its positions, and proposes `limits`. Does no I/O.
//
// Speeds are means over at least 20 ms, so that noise does not count as motion. Accelerations are the changes of speed. For
// shorter motions, both are too low rather than too high; the margins cover that.
class MotionWatch {
 public:
  // `position` must be valid.
  void On(const position_t& position);

  [[nodiscard]] double speed_rpm() const { return speed_rpm_; }        // the fastest so far
  [[nodiscard]] double accel_rad_s2() const { return accel_rad_s2_; }  // likewise

  // Compares the motion with the limits of the device: its own limits, or only those of its model.
  [[nodiscard]] FindingGroup Evaluate(const DeviceConfig& device) const;

  static constexpr double kSpeedMargin = 1.5;
  static constexpr double kAccelMargin = 2;

 private:
  struct Stretch {
    double seconds = 0;
    double rad_s = 0;
  };

  double speed_rpm_ = 0;
  double accel_rad_s2_ = 0;
  std::optional<position_t> begin_;  // of the current stretch
  std::optional<Stretch> before_;    // the previous stretch
};

// Returns a proposed limit, rounded up to two digits, at most `maximum`, the model's limit (0: the model has none).
[[nodiscard]] double ProposedLimit(double seen, double margin, double maximum);

// Evaluates the messages of one device and its bus for an acceptance. Does no I/O.
class HardwareWatch {
 public:
  HardwareWatch(const BusConfig& bus, const DeviceConfig& device) : bus_config_(bus), device_(device) {}

  void OnMessage(std::string_view channel, Bytes message);
  // Returns true if DEVICE and BUS were received at least twice.
  [[nodiscard]] bool Complete() const { return infos_ >= 2 && buses_ >= 2; }
  [[nodiscard]] std::int64_t readings() const;  // good readings since the first message
  [[nodiscard]] std::int64_t errors() const;    // failed readings
  [[nodiscard]] const std::optional<position_t>& position() const {
    return position_;
  }  // the newest valid position
  [[nodiscard]] const std::optional<device_info_t>& info() const { return info_; }

  [[nodiscard]] Findings Evaluate() const;

 private:
  void AddIdentity(Findings& findings) const;
  void AddReadings(Findings& findings) const;
  [[nodiscard]] std::string NoReadingAdvice() const;
  void AddBus(Findings& findings) const;
  void AddAlarms(Findings& findings) const;

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
  std::int64_t invalid_ = 0;
  MotionWatch motion_;
  float fastest_us_ = 0;  // of all windows; 0: no window yet
  float slowest_p99_us_ = 0;
  std::vector<float> p50_us_;  // of each window
  std::vector<alarm_entry_t> alarms_;
  bool has_alarms_ = false;
};

// Returns what to do about failed readings of this kind (device_info_t ERROR_*) on a bus of this family. `some_good`: other
// readings at the time were good, so that wiring and settings are mostly right. `family` may be null: a serial line.
[[nodiscard]] std::string ErrorAdvice(std::size_t kind, const Family* family, bool some_good);

// Evaluates one turn of the shaft by hand. `turns` is in the device's direction.
[[nodiscard]] AcceptanceResult EvaluateRotation(double turns, std::int8_t direction);

}  // namespace axlecast
