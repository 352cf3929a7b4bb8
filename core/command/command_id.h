#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "core/device/operation.h"

namespace axlecast {

// Returns the id in a message: 16 bytes.
template <typename Bytes16>
[[nodiscard]] CommandId IdOf(const Bytes16& bytes) {
  static_assert(sizeof bytes == sizeof(CommandId));
  CommandId id;
  std::copy(std::begin(bytes), std::end(bytes), id.begin());
  return id;
}

// Formats and parses an id as 32 hex digits.
[[nodiscard]] std::string IdText(const CommandId& id);
[[nodiscard]] std::optional<CommandId> ParseId(std::string_view text);

// Parses exactly `bytes.size()` bytes in hex, and nothing else.
[[nodiscard]] bool ParseHex(std::string_view text, std::span<std::uint8_t> bytes);

// Returns command_status_t.body_digest: the first 8 bytes, big-endian, of BLAKE2b-256 of an encoded command_body_t.
[[nodiscard]] std::int64_t BodyDigest(Bytes body);

}  // namespace axlecast
