#pragma once

#include <compare>
#include <cstdint>

namespace axlecast {

// A sender's address: what the kernel says of the datagram.
struct SenderAddress {
  std::uint32_t address = 0;  // IPv4, host order
  std::uint16_t port = 0;
  auto operator<=>(const SenderAddress&) const = default;
};

}  // namespace axlecast
