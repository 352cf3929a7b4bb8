#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/inline_bytes.h"

namespace axlecast {

// Numbers as LCM writes them.

template <std::unsigned_integral Value>
void AppendBigEndian(std::vector<std::uint8_t>& bytes, Value value) {
  for (std::size_t shift = sizeof(Value) * 8; shift > 0;) {
    shift -= 8;
    bytes.push_back(static_cast<std::uint8_t>(value >> shift));
  }
}

// The number that stands at `offset`; all its bytes are there.
template <std::unsigned_integral Value>
[[nodiscard]] Value ReadBigEndian(Bytes bytes, std::size_t offset) {
  Value value = 0;
  for (std::size_t i = 0; i < sizeof(Value); ++i) value = static_cast<Value>(value << 8U | bytes[offset + i]);
  return value;
}

}  // namespace axlecast
