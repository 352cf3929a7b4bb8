#pragma once

#include "core/base/time.h"

namespace axlecast {

// The only place that reads the operating system's clocks.
class SystemClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override;
  [[nodiscard]] std::int64_t UtcMicroseconds() const override;
};

}  // namespace axlecast
