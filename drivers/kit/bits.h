#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>

#include "core/base/inline_bytes.h"

namespace axlecast {

// Bit `index` of what was clocked in: the most significant bit of the first byte came first.
[[nodiscard]] constexpr bool BitAt(Bytes bytes, std::size_t index) {
  return (bytes[index / 8] >> (7 - index % 8) & 1) != 0;
}

// `count` bits from `first` on, at most 64, the first of them the most significant.
[[nodiscard]] constexpr std::uint64_t BitsAt(Bytes bytes, std::size_t first, std::size_t count) {
  assert(count <= 64 && first + count <= bytes.size() * 8);
  std::uint64_t value = 0;
  for (std::size_t at = first, left = count; left > 0;) {
    const std::size_t in_byte = 8 - at % 8;
    const std::size_t taken = in_byte < left ? in_byte : left;
    value = value << taken | (bytes[at / 8] >> (in_byte - taken) & ((1U << taken) - 1));
    at += taken;
    left -= taken;
  }
  return value;
}

}  // namespace axlecast
