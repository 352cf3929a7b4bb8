#pragma once

#include <algorithm>
#include <cinttypes>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "tests/time_guests/judge.h"

// How the programs that judge a recorded run print their figures.
namespace axlecast {

inline double Milliseconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-6; }

// Returns 0 without values.
inline std::int64_t Percentile(std::vector<std::int64_t> values, std::size_t percent) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * percent / 100);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// Prints nothing if nothing was counted.
inline void Print(const char* what, const Verdicts& verdicts) {
  if (verdicts.holds + verdicts.misses + verdicts.undecided + verdicts.unjudged == 0) return;
  std::printf("  %-34s %6" PRId64 " hold the truth, %" PRId64 " miss it, %" PRId64
              " within the oracle's error, %" PRId64 " outside of its readings\n",
              what, verdicts.holds, verdicts.misses, verdicts.undecided, verdicts.unjudged);
}

}  // namespace axlecast
