#pragma once

#include <cstdint>

#include "drivers/runtime/core/instant.h"

namespace axlecast {

// Both clocks, read together.
struct Instant {
  MonoNs mono = 0;
  std::int64_t utime = 0;  // us, UNIX time
};

}  // namespace axlecast
