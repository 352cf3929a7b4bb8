#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"

namespace axlecast::saa_can::cia406 {

// Time on the wire of a data frame with an 11-bit identifier (ISO 11898-1 10.4): 44 bits and the data; of these 34
// and the data are subject to stuffing, at most one bit after the first five and then after each four.
struct FrameTime {
  std::int64_t bitrate = 0;  // bit/s; 0: on a simulated wire, which may be faster than any: no time

  // From the first bit to the last but one, when receivers take it as valid.
  [[nodiscard]] constexpr MonoNs Shortest(std::size_t data) const { return Bits(43 + 8 * data); }
  // With every stuff bit that there can be, and the three bits between frames.
  [[nodiscard]] constexpr MonoNs Longest(std::size_t data) const {
    return Bits(47 + 8 * data + (33 + 8 * data) / 4);
  }

 private:
  [[nodiscard]] constexpr MonoNs Bits(std::size_t bits) const {
    return bitrate == 0 ? 0 : static_cast<MonoNs>(bits) * kSecond / bitrate;
  }
};

}  // namespace axlecast::saa_can::cia406
