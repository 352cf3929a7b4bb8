#pragma once

#include <axlecast/position_set_t.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/time_guests/guest_run.h"
#include "tests/time_guests/judge.h"

namespace axlecast {

// Sets of axes of several guests that were read on one tick, compared with the true instants of sampling. Those follow from the positions of
// the simulated shafts.
struct TickFigures {
  std::string maker;            // who made the sets
  std::string phase;            // the part of the test in which they arrived
  std::int64_t ticks = 0;       // sets
  std::int64_t incomplete = 0;  // sets without every axis: not judged
  // Of a complete tick: each axis was sampled within its own interval, and all axes within the hull.
  Verdicts judged;
  // Of judged ticks, in ns.
  std::vector<std::int64_t> spreads;       // the true ones: latest minus earliest instant of sampling
  std::vector<std::int64_t> hulls;         // the stated ones
  std::vector<std::int64_t> from_middles;  // of each axis: its true instant from the middle of its interval
  std::int64_t oracle_error = 0;           // greatest width of the bounds of a true instant
};

// Moves the interval of each axis by this number of its half widths, and the hull with them. The judge must find this.
[[nodiscard]] position_set_t Moved(position_set_t set, double half_widths);

// Judges the sets that `axlecast sets` published, and those that axlecast/position_sets.h makes in each guest of the messages that arrive there.
[[nodiscard]] std::vector<TickFigures> JudgeTicks(const GuestRun& run, double shift);

// Returns true if no tick misses the truth, and at least so many of each maker hold it.
[[nodiscard]] bool IsTrue(const std::vector<TickFigures>& figures, std::int64_t least);

}  // namespace axlecast
