#include "core/command/command_id.h"

#include <sodium.h>

#include <cstdint>

#include "core/base/text.h"

namespace axlecast {

std::string IdText(const CommandId& id) { return HexDigits(id); }

std::optional<CommandId> ParseId(std::string_view text) {
  CommandId id{};
  return ParseHex(text, id) ? std::optional(id) : std::nullopt;
}

bool ParseHex(std::string_view text, std::span<std::uint8_t> bytes) {
  std::size_t parsed = 0;
  return text.size() == 2 * bytes.size() &&
         sodium_hex2bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, &parsed, nullptr) == 0 &&
         parsed == bytes.size();
}

std::int64_t BodyDigest(Bytes body) {
  std::array<std::uint8_t, crypto_generichash_BYTES> hash;  // 32 bytes: BLAKE2b-256
  crypto_generichash(hash.data(), hash.size(), body.data(), body.size(), nullptr, 0);
  std::uint64_t digest = 0;
  for (std::size_t i = 0; i < 8; ++i) digest = digest << 8 | hash[i];
  return static_cast<std::int64_t>(digest);
}

}  // namespace axlecast
