#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>

namespace axlecast::bench {

using Id = std::array<std::uint8_t, 16>;

// Of a command, an order or a status.
template <typename Message>
Id IdOf(const Message& message) {
  Id id;
  std::copy(std::begin(message.id), std::end(message.id), id.begin());
  return id;
}

}  // namespace axlecast::bench
