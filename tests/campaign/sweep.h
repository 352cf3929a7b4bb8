#pragma once

#include <cmath>

#include "drivers/runtime/core/instant.h"

namespace axlecast {

// Turns of a shaft that turns within its limits, through all positions alike: up to 68 turns a second, 4,060 rpm.
[[nodiscard]] inline double SweepTurns(MonoNs at) {
  const double t = static_cast<double>(at) * 1e-9;
  return 31.7 * t + 4.0 * std::sin(t * 9.0);
}

}  // namespace axlecast
