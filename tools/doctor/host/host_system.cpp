#include "tools/doctor/host/host_system.h"

#include <sys/resource.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>

namespace axlecast {

RealtimeLimits ReadRealtimeLimits() {
  if (geteuid() == 0) return {.priority = 99, .locked_bytes = -1};
  rlimit priority{};
  rlimit locked{};
  if (getrlimit(RLIMIT_RTPRIO, &priority) != 0 || getrlimit(RLIMIT_MEMLOCK, &locked) != 0) return {};
  return {.priority = static_cast<std::int64_t>(std::min<rlim_t>(priority.rlim_cur, 99)),
          .locked_bytes = locked.rlim_cur == RLIM_INFINITY ? -1 : static_cast<std::int64_t>(locked.rlim_cur)};
}

ClockSync ReadClockSync() {
  timex answer{};  // modes 0: asks, sets nothing
  const int state = adjtimex(&answer);
  return {.known = state >= 0, .synchronised = state >= 0 && state != TIME_ERROR};
}

}  // namespace axlecast
