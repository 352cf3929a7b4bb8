#pragma once

#include <cstdint>
#include <ctime>

namespace axlecast::bench {

// CLOCK_MONOTONIC in ns, the clock of every message's mono_ns.
inline std::int64_t MonotonicNow() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * INT64_C(1'000'000'000) + now.tv_nsec;
}

inline void SleepUntil(std::int64_t instant) {
  const timespec until{.tv_sec = instant / 1'000'000'000, .tv_nsec = instant % 1'000'000'000};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
}

}  // namespace axlecast::bench
