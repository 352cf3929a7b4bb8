#pragma once

#include <cstdint>

namespace axlecast {

// What this process may ask of ApplyRealtime (platform/os/process.h).
struct RealtimeLimits {
  std::int64_t priority = 0;      // the highest SCHED_FIFO priority (RLIMIT_RTPRIO); 99 for root
  std::int64_t locked_bytes = 0;  // of memory (RLIMIT_MEMLOCK); -1: any
};
[[nodiscard]] RealtimeLimits ReadRealtimeLimits();

// Whether something keeps UNIX time in step with the world's (adjtimex(2)).
struct ClockSync {
  bool known = false;
  bool synchronised = false;
};
[[nodiscard]] ClockSync ReadClockSync();

}  // namespace axlecast
