#pragma once

#include <cstdint>

namespace axlecast {

// An instant or a duration on CLOCK_MONOTONIC, in nanoseconds. Deadlines and measurements use nothing else.
using MonoNs = std::int64_t;

inline constexpr MonoNs kMicrosecond = 1'000;
inline constexpr MonoNs kMillisecond = 1'000'000;
inline constexpr MonoNs kSecond = 1'000'000'000;

// Never reached: a deadline that does not exist.
inline constexpr MonoNs kNever = INT64_MAX;

// A stretch of time; what happened began at `first` and was over at `last`.
struct Interval {
  MonoNs first = 0;
  MonoNs last = 0;

  [[nodiscard]] constexpr MonoNs Middle() const { return first + (last - first) / 2; }
  [[nodiscard]] constexpr MonoNs HalfWidth() const { return (last - first + 1) / 2; }
  friend constexpr bool operator==(const Interval&, const Interval&) = default;
};

// Both clocks, read together.
struct Timestamp {
  MonoNs mono = 0;
  std::int64_t utime = 0;  // us, UNIX time
};

}  // namespace axlecast
