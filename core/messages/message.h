#pragma once

#include <array>
#include <cassert>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "core/base/inline_bytes.h"

namespace axlecast {

// Sends encoded messages. platform/net/lcm_port.h sends them to the network. Thread-safe.
class MessageSink {
 public:
  virtual ~MessageSink() = default;
  virtual void Publish(const std::string& channel, Bytes message) = 0;
};

// The longest message: it fits one Ethernet frame, because LCM 1.3 loses reordered fragments.
inline constexpr int kMaxMessage = 1400;

// Encodes an LCM message on the stack and publishes it. Allocates nothing. Returns false, and sends nothing, if the message is longer
// than kMaxMessage. This cannot happen as long as every string is limited where it is set.
template <typename Message>
bool Publish(MessageSink& sink, const std::string& channel, const Message& message) {
  std::array<std::uint8_t, kMaxMessage> buffer;
  const int size = message.encode(buffer.data(), 0, kMaxMessage);
  assert(size > 0);
  if (size <= 0) return false;
  sink.Publish(channel, Bytes(buffer.data(), static_cast<std::size_t>(size)));
  return true;
}

// Decodes an LCM message from untrusted bytes. Returns nothing if it is malformed. The generated decoders throw on a negative length
// or count.
template <typename Message>
std::optional<Message> DecodeMessage(Bytes bytes) {
  try {
    Message message;
    const int used = message.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
    if (used < 0 || static_cast<std::size_t>(used) != bytes.size()) return std::nullopt;
    return message;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

// Returns the int64_t at `offset` of an encoded message, which contains it. LCM encodes big-endian.
[[nodiscard]] inline std::int64_t ReadInt64(Bytes message, std::size_t offset) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : message.subspan(offset, 8)) value = (value << 8U) | byte;
  return static_cast<std::int64_t>(value);
}

// Returns the message as LCM transmits it: fingerprint and fields.
template <typename Message>
[[nodiscard]] std::vector<std::uint8_t> Encoded(const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace axlecast
