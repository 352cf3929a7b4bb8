#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tests/time_guests/clock_page.h"

namespace axlecast {

// What contains a true value, of which nothing more is known.
struct Bounds {
  std::int64_t lowest = 0;
  std::int64_t highest = 0;

  // Of the sum: `other` contains what is added.
  [[nodiscard]] Bounds Plus(const Bounds& other) const { return {lowest + other.lowest, highest + other.highest}; }
  [[nodiscard]] Bounds Minus(const Bounds& other) const { return {lowest - other.highest, highest - other.lowest}; }
};

// The clocks of a host as functions of its time stamp counter, from readings. Each function returns bounds of the truth. Between two
// readings, a clock is assumed to run at rates between those that it has there and between the neighbouring readings. This holds if its
// rate changes at most once within three intervals of readings, 30 ms if the host is not starved.
class ClockLog {
 public:
  enum class Clock { kMono, kRaw, kUtc };  // kUtc may be stepped: nothing is known at a step

  // Takes a reading. Ignores it if its bracket overlaps that of the one before.
  void Add(const ClockReading& reading);

  // Returns what a clock read at an instant that `ticks` contains. Nothing outside of the readings, and nothing if the readings around it
  // contradict the assumption.
  [[nodiscard]] std::optional<Bounds> At(Clock clock, const Bounds& ticks) const;
  // Returns the counter at the instant at which a clock, not kUtc, read `ns`.
  [[nodiscard]] std::optional<Bounds> When(Clock clock, std::int64_t ns) const;

  // Returns the longest time between two readings within these ticks, in ns: how long the host was starved.
  [[nodiscard]] std::int64_t LongestGap(CpuTicks from, CpuTicks until) const;

  [[nodiscard]] const std::vector<ClockReading>& readings() const { return readings_; }
  // Returns the reading that is the first at or after `ticks`, or the number of readings.
  [[nodiscard]] std::size_t IndexAt(CpuTicks ticks) const;

 private:
  std::vector<ClockReading> readings_;
};

}  // namespace axlecast
