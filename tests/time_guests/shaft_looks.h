#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "tests/time_guests/clock_log.h"

namespace axlecast {

// Where a simulated shaft was, as its simulator answered: the angle at an instant of CLOCK_MONOTONIC of its guest.
struct ShaftLook {
  MonoNs mono = 0;
  double turns = 0;
  double speed_rpm = 0;
};

// A shaft that turns at a constant speed. A position of it gives the instant at which it was sampled, to within the time of one count.
class ShaftLooks {
 public:
  void Add(const ShaftLook& look) { looks_.push_back(look); }

  // Returns bounds of the instant at which the encoder had these counts, on CLOCK_MONOTONIC of the guest. Returns nothing outside of the
  // looks, and nothing if two looks contradict each other: the speed was then not constant.
  [[nodiscard]] std::optional<Bounds> When(std::int64_t counts, std::int64_t counts_per_turn) const;

 private:
  std::vector<ShaftLook> looks_;
};

// Reads the lines "DEVICE MONO_NS ANGLE_DEG SPEED_RPM" of a file. A file that does not exist has none.
[[nodiscard]] Result<std::map<std::string, ShaftLooks>> ReadShaftLooks(const std::filesystem::path& path);

}  // namespace axlecast
