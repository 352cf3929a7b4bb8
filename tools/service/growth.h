#pragma once

#include <algorithm>
#include <cstdint>

namespace axlecast {

// A damaged message may say anything: no counter, and no sum of counters, is believed beyond this.
inline constexpr std::int64_t kMaxCounts = std::int64_t{1} << 50;

// How far a counter has risen; 0 where it has not.
[[nodiscard]] constexpr std::int64_t Growth(std::int64_t before, std::int64_t now) {
  const auto believed = [](std::int64_t counts) { return std::clamp<std::int64_t>(counts, 0, kMaxCounts); };
  return std::max<std::int64_t>(believed(now) - believed(before), 0);
}

}  // namespace axlecast
