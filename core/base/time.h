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

// The one source of time. The real one is platform/os/system_clock.h; tests inject their own.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual MonoNs Now() const = 0;                    // CLOCK_MONOTONIC
  [[nodiscard]] virtual std::int64_t UtcMicroseconds() const = 0;  // CLOCK_REALTIME, us UNIX
};

// UNIX time of an instant on CLOCK_MONOTONIC: the offset between the two clocks, slewed by at most 500 us per
// second, so that utime stays smooth while an NTP daemon slews; a difference beyond 1 ms is a step and is followed
// at once.
class Timebase {
 public:
  // Both clocks read together. True when UNIX time was stepped since the last call.
  bool Update(MonoNs now, std::int64_t utc_us);
  [[nodiscard]] std::int64_t Utime(MonoNs instant) const { return offset_us_ + instant / kMicrosecond; }
  // Number of steps since the start.
  [[nodiscard]] std::int64_t steps() const { return steps_; }

 private:
  bool started_ = false;
  MonoNs updated_ = 0;
  std::int64_t offset_us_ = 0;
  std::int64_t steps_ = 0;
};

}  // namespace axlecast
