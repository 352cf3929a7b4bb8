#include "platform/os/system_clock.h"

#include <ctime>

namespace axlecast {
namespace {

MonoNs Read(clockid_t id) {
  timespec now{};
  clock_gettime(id, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

}  // namespace

MonoNs SystemClock::Now() const { return Read(CLOCK_MONOTONIC); }

std::int64_t SystemClock::UtcMicroseconds() const { return Read(CLOCK_REALTIME) / kMicrosecond; }

}  // namespace axlecast
