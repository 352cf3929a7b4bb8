#pragma once

#include <cstdint>
#include <vector>

namespace axlecast {

// Returns the message as LCM transmits it: fingerprint and fields.
template <typename Message>
[[nodiscard]] std::vector<std::uint8_t> Encoded(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace axlecast
