#pragma once

#include <poll.h>

#include <span>

#include "core/base/time.h"

namespace axlecast {

// The only place that reads the operating system's clocks.
class SystemClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override;
  [[nodiscard]] std::int64_t UtcMicroseconds() const override;
};

// ppoll with a deadline of `clock` (kNever: for ever) that a signal does not end. After the deadline, it does not wait.
[[nodiscard]] int PollUntil(std::span<pollfd> files, MonoNs deadline, const Clock& clock);

// Returns at `time` or a little later, never before. Sleeps, and spins at the end, because a sleep may end 50 us late.
void WaitUntil(MonoNs time, const Clock& clock);

}  // namespace axlecast
