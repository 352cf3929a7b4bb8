#pragma once

#include <cstdint>
#include <string>

namespace axlecast {

// How this host would send to a multicast group. Nothing is sent.
struct MulticastRoute {
  int error = 0;          // errno if the kernel has no route: ENETUNREACH
  std::string interface;  // the outgoing interface; empty if unknown
};
[[nodiscard]] MulticastRoute FindMulticastRoute(const std::string& group);

struct LoopbackState {
  bool known = false;
  bool up = false;
  bool multicast = false;
};
[[nodiscard]] LoopbackState ReadLoopback();

// The limits of this process for ApplyRealtime (platform/os/process.h).
struct RealtimeLimits {
  std::int64_t priority = 0;      // maximum SCHED_FIFO priority (RLIMIT_RTPRIO); 99 for root
  std::int64_t locked_bytes = 0;  // of memory (RLIMIT_MEMLOCK); -1: unlimited
};
[[nodiscard]] RealtimeLimits ReadRealtimeLimits();

// Whether a service synchronises UNIX time (adjtimex(2)).
struct ClockSync {
  bool known = false;
  bool synchronised = false;
};
[[nodiscard]] ClockSync ReadClockSync();

}  // namespace axlecast
