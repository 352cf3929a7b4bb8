#pragma once

#include <cstdint>

#include "drivers/runtime/core/instant.h"

namespace axlecast {

// Where the shaft was: unwrapped counts in the encoder's own direction and from its own zero.
struct Fix {
  std::int64_t counts = 0;
  Interval at;                // holds the sampling instant
  bool low_accuracy = false;  // the single-turn resolution was reduced
};

}  // namespace axlecast
