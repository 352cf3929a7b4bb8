#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// Where the shaft was: unwrapped counts in the encoder's own direction and from its own zero.
struct UnwrappedSample {
  std::int64_t counts = 0;
  Interval at;                // holds the sampling instant
  bool low_accuracy = false;  // the single-turn resolution was reduced
};

}  // namespace axlecast
