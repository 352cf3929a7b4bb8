#pragma once

#include <cstdint>

namespace axlecast {

// Remainder in [0, modulus), also of negative numbers. Without a division where `counts` is near.
[[nodiscard]] constexpr std::int64_t FloorMod(std::int64_t counts, std::int64_t modulus) {
  if (counts >= 0 && counts < modulus) return counts;
  if (counts < 0 && counts >= -modulus) return counts + modulus;
  const std::int64_t rest = counts % modulus;
  return rest < 0 ? rest + modulus : rest;
}

// The number congruent to `counts` that is nearest to `around`: in [around - modulus/2, around + modulus/2).
[[nodiscard]] constexpr std::int64_t Nearest(std::int64_t counts, std::int64_t modulus, std::int64_t around) {
  const std::int64_t ahead = FloorMod(counts - around, modulus);
  return around + (ahead < modulus - modulus / 2 ? ahead : ahead - modulus);
}

}  // namespace axlecast
