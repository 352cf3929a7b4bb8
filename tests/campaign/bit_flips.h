#pragma once

#include <cstdint>
#include <random>

namespace axlecast {

// Noise on a line: bits inverted independently, found by the gaps between them.
class BitFlips {
 public:
  // `rate` of all bits, < 1; at 0 none is inverted. `random` must outlive this.
  BitFlips(double rate, std::mt19937_64& random)
      : rate_(rate), random_(random), gap_(rate > 0 ? rate : 0.5), until_(gap_(random_)) {}

  // flip(i) for every inverted one of the next `bits` bits.
  template <typename Flip>
  void Over(std::int64_t bits, Flip flip) {
    if (rate_ <= 0) return;
    for (; until_ < bits; until_ += 1 + gap_(random_)) flip(until_);
    until_ -= bits;
  }

 private:
  const double rate_;
  std::mt19937_64& random_;
  std::geometric_distribution<std::int64_t> gap_;
  std::int64_t until_;  // the next inverted bit, from here
};

}  // namespace axlecast
