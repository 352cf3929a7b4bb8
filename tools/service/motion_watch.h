#pragma once

#include <axlecast/position_t.hpp>
#include <optional>

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

}  // namespace axlecast
