#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/runtime/axis/unwrapped_sample.h"

namespace axlecast {

// The shaft's speed from its last good readings: the slope of the straight line that fits those of the last 8 ms
// best (readings 0.5 ms or more apart, up to 16). From slower readings up to 20 ms, or as far back as it takes until
// their instants are known well enough, at most 0.5 s. So it is the speed of about half that time ago.
class Speed {
 public:
  void Add(const UnwrappedSample& fix);
  void Forget() { size_ = 0; }
  // Counts per second; NaN while it cannot be told: fewer than two readings, less than 1 ms between them, or
  // instants known to worse than a quarter of the time they span.
  [[nodiscard]] double CountsPerSecond() const;

 private:
  static constexpr std::size_t kSize = 16;
  static constexpr MonoNs kSpacing = 500 * kMicrosecond;
  static constexpr MonoNs kWindow = 20 * kMillisecond;
  static constexpr MonoNs kLongest = 500 * kMillisecond;
  static constexpr MonoNs kShortest = kMillisecond;

  [[nodiscard]] const UnwrappedSample& Back(std::size_t i) const { return ring_[(newest_ + kSize - i) % kSize]; }
  // The last `used` readings tell a speed.
  [[nodiscard]] bool Known(std::size_t used) const;
  [[nodiscard]] std::size_t Used() const;

  std::array<UnwrappedSample, kSize> ring_{};
  std::size_t newest_ = 0;
  std::size_t size_ = 0;
  UnwrappedSample last_;
};

}  // namespace axlecast
