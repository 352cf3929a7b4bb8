#include "platform/os/system_clock.h"

#include <sys/timex.h>

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

MonoNs RawNow() { return Read(CLOCK_MONOTONIC_RAW); }

HostClocks ReadHostClocks() {
  constexpr int kAttempts = 5;
  HostClocks best;
  for (int i = 0; i < kAttempts; ++i) {
    HostClocks clocks;
    clocks.raw_before = Read(CLOCK_MONOTONIC_RAW);
    clocks.mono = Read(CLOCK_MONOTONIC);
    clocks.boot = Read(CLOCK_BOOTTIME);
    clocks.raw_after = Read(CLOCK_MONOTONIC_RAW);
    const MonoNs width = clocks.raw_after - clocks.raw_before;
    if (i == 0 || width < best.raw_after - best.raw_before) best = clocks;
  }
  return best;
}

UtcReading ReadUtc() {
  constexpr int kAttempts = 5;
  UtcReading best{.mono_before = 0, .utc_ns = 0, .mono_after = kNever};
  for (int i = 0; i < kAttempts; ++i) {
    UtcReading reading;
    reading.mono_before = Read(CLOCK_MONOTONIC);
    reading.utc_ns = Read(CLOCK_REALTIME);
    reading.mono_after = Read(CLOCK_MONOTONIC);
    if (reading.mono_after - reading.mono_before < best.mono_after - best.mono_before) best = reading;
  }
  return best;
}

KernelUtc ReadKernelUtc() {
  timex state{};
  const int answer = adjtimex(&state);
  if (answer < 0) return {};
  return {.tai_offset_s = state.tai,
          .leap_today = (state.status & (STA_INS | STA_DEL)) != 0,
          .known = true,
          .synchronised = answer != TIME_ERROR};
}

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
