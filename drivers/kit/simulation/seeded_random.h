#pragma once

#include <cstdint>

namespace axlecast {

// A repeatable stream of random numbers (splitmix64): the same seed gives the same faults on every machine.
class SeededRandom {
 public:
  explicit SeededRandom(std::uint64_t seed) : state_(seed) {}

  std::uint64_t Next() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15U;
    z = (z ^ z >> 30U) * 0xBF58476D1CE4E5B9U;
    z = (z ^ z >> 27U) * 0x94D049BB133111EBU;
    return z ^ z >> 31U;
  }
  // In [0, 1).
  double Share() { return static_cast<double>(Next() >> 11U) * 0x1p-53; }
  // In [-bound, bound].
  std::int64_t Around(std::int64_t bound) {
    const auto values = static_cast<std::uint64_t>(bound) * 2 + 1;
    return static_cast<std::int64_t>(Next() % values) - bound;
  }

 private:
  std::uint64_t state_;
};

}  // namespace axlecast
