#pragma once

#include <cstdint>

#include "core/base/time.h"

namespace axlecast {

// The one source of time. The real one is platform/os/system_clock.h; tests inject their own.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual MonoNs Now() const = 0;                    // CLOCK_MONOTONIC
  [[nodiscard]] virtual std::int64_t UtcMicroseconds() const = 0;  // CLOCK_REALTIME, us UNIX
};

}  // namespace axlecast
