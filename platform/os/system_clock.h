#pragma once

#include <poll.h>

#include <span>

#include "core/base/time.h"
#include "core/time/time_keeper.h"
#include "core/time/utc_claim.h"

namespace axlecast {

// The only place that reads the operating system's clocks.
class SystemClock final : public Clock {
 public:
  [[nodiscard]] MonoNs Now() const override;
  [[nodiscard]] std::int64_t UtcMicroseconds() const override;
};

// CLOCK_MONOTONIC_RAW, in ns.
[[nodiscard]] MonoNs RawNow();

// Returns the clocks of this host, read together: the narrowest of a few attempts, because a reading that the scheduler interrupts is
// wide.
[[nodiscard]] HostClocks ReadHostClocks();

// Reads UNIX time between two readings of CLOCK_MONOTONIC: the closest of a few attempts.
[[nodiscard]] UtcReading ReadUtc();

// What the kernel knows of UTC.
struct KernelUtc {
  int tai_offset_s = 0;       // TAI - UTC; 0: not known
  bool leap_today = false;    // a leap second will be inserted or deleted
  bool known = false;         // the kernel has answered
  bool synchronised = false;  // a program keeps UNIX time, and has stated so to the kernel. How well is not known
};
[[nodiscard]] KernelUtc ReadKernelUtc();

// ppoll with a deadline of `clock` (kNever: for ever) that a signal does not end. After the deadline, it does not wait.
[[nodiscard]] int PollUntil(std::span<pollfd> files, MonoNs deadline, const Clock& clock);

// Returns at `time` or a little later, never before. Sleeps, and spins at the end, because a sleep may end 50 us late.
void WaitUntil(MonoNs time, const Clock& clock);

}  // namespace axlecast
