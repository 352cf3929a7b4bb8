#pragma once

#include <exception>
#include <optional>

#include "core/base/inline_bytes.h"

namespace axlecast {

// Decodes an LCM message from untrusted bytes. The generated decoders throw on a negative length or count; here
// every malformed message is simply no message.
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

}  // namespace axlecast
