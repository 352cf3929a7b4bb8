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

// ppoll with a deadline of `clock` (kNever: for ever) that a signal does not end. Past deadlines only look.
[[nodiscard]] int PollUntil(std::span<pollfd> files, MonoNs deadline, const Clock& clock);

// Returns at `instant` or a little later, never before it: sleeps most of the time and spins through the last
// stretch, so that a pulse of 10 us is not one of 60 us.
void WaitUntil(MonoNs instant, const Clock& clock);

}  // namespace axlecast
