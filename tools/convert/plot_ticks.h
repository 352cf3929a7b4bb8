#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace axlecast {

// A mark of an axis.
struct Tick {
  double at = 0;
  std::string label;
};

// An axis that begins and ends at round numbers around its values, with a tick at every 1, 2 or 5 times a power of ten.
struct RoundAxis {
  double low = 0;
  double high = 1;
  std::vector<Tick> ticks;
};

// Around [low, high], which are finite; with about `wanted` ticks. One number alone gets room on both sides.
[[nodiscard]] RoundAxis MakeRoundAxis(double low, double high, int wanted);

// Ticks at round times of day (1, 2, 5, 15, 30 s, ...) within [first_us, last_us], at most about `wanted`; `at` in us.
// `title` says what the labels leave out: the time scale and the date.
struct TimeAxis {
  std::vector<Tick> ticks;
  std::string title;
};
[[nodiscard]] TimeAxis MakeTimeAxis(std::int64_t first_us, std::int64_t last_us, int wanted);

}  // namespace axlecast
