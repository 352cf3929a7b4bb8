#pragma once

#include <array>

#include "core/device/family.h"

namespace axlecast {

// A family with three settings, at registers 0, 1 and 5; for tests.
inline const Family& ParameterFamily() {
  static constexpr std::array<ParameterSpec, 3> kParameters = {
      ParameterSpec{"power_limit", 0, "W", 1, 0, 10'000, true, "power limit; 0: no trip"},
      ParameterSpec{"start_time", 1, "s", 1, 1, 50, false, "time after the start without trips"},
      ParameterSpec{"shock_limit", 5, "m/s2", 2, 0, 15'000, true, "acceleration at which it trips"}};
  static const Family family = [] {
    Family made;
    made.name = "made_up";
    made.has_position = false;
    made.parameters = kParameters;
    return made;
  }();
  return family;
}

}  // namespace axlecast
