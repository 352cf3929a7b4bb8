#pragma once

#include <axlecast/position_tracker.h>
#include <axlecast/device_info_t.hpp>
#include <axlecast/position_t.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>

namespace axlecast {

// The first DEVICE message of each of a device's drivers, by boot id.
using DeviceByBoot = std::map<std::int64_t, device_info_t>;

// One device's positions at the instants of a time grid.
class GridChannel {
 public:
  // At one instant. Nothing is said of what is not known.
  struct Cell {
    std::optional<double> value;        // in the device's unit; needs its DEVICE message
    std::optional<double> counts;       // on the line between the readings around it
    std::optional<std::int32_t> flags;  // of the reading before, or at it, if not older than the maximum age
  };
  // `index`: of the instant, in periods of the grid since 1970.
  using Sink = std::function<void(std::int64_t index, const Cell& cell)>;

  // us. No line is drawn between readings further apart than `max_age_us`; 0: the device's own (DEVICE), else 50 ms.
  GridChannel(std::int64_t period_us, std::int64_t max_age_us, DeviceByBoot devices);

  // Tells the instants since the reading before, up to this one.
  void On(const position_t& position, const Sink& sink);

 private:
  [[nodiscard]] Cell At(std::int64_t utime, std::int32_t flags) const;

  std::int64_t period_us_;
  std::int64_t max_age_us_;
  DeviceByBoot devices_;
  PositionTracker tracker_;
  std::optional<position_t> before_;
};

}  // namespace axlecast
