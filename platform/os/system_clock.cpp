#include "platform/os/system_clock.h"

#include <algorithm>
#include <cerrno>
#include <ctime>

namespace axlecast {
namespace {

MonoNs Read(clockid_t id) {
  timespec now{};
  clock_gettime(id, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

// A thread without timer slack of its own (ApplyRealtime) wakes up to 50 us late.
constexpr MonoNs kSpin = 100 * kMicrosecond;

timespec ToTimespec(MonoNs duration) {
  const MonoNs positive = std::max<MonoNs>(duration, 0);
  return {positive / kSecond, positive % kSecond};
}

}  // namespace

MonoNs SystemClock::Now() const { return Read(CLOCK_MONOTONIC); }

std::int64_t SystemClock::UtcMicroseconds() const { return Read(CLOCK_REALTIME) / kMicrosecond; }

int PollUntil(std::span<pollfd> files, MonoNs deadline, const Clock& clock) {
  while (true) {
    const timespec left = ToTimespec(deadline == kNever ? 0 : deadline - clock.Now());
    const int ready = ppoll(files.data(), files.size(), deadline == kNever ? nullptr : &left, nullptr);
    if (ready >= 0 || errno != EINTR) return ready;
  }
}

void WaitUntil(MonoNs time, const Clock& clock) {
  // If this failed, the loop would wait the whole time.
  if (time - clock.Now() > kSpin) static_cast<void>(PollUntil({}, time - kSpin, clock));
  while (clock.Now() < time) {
  }
}

}  // namespace axlecast
