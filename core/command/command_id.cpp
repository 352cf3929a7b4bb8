#include "core/command/command_id.h"

#include <sodium.h>

#include <cstdint>

namespace axlecast {
namespace {

int HexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

std::string IdText(const CommandId& id) {
  static constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : id) {
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

std::optional<CommandId> ParseId(std::string_view text) {
  CommandId id{};
  if (text.size() != 2 * id.size()) return std::nullopt;
  for (std::size_t i = 0; i < id.size(); ++i) {
    const int high = HexDigit(text[2 * i]);
    const int low = HexDigit(text[2 * i + 1]);
    if (high < 0 || low < 0) return std::nullopt;
    id[i] = static_cast<std::uint8_t>(high * 16 + low);
  }
  return id;
}

std::int64_t BodyDigest(Bytes body) {
  std::array<std::uint8_t, crypto_generichash_BYTES> hash;  // 32 bytes: BLAKE2b-256
  crypto_generichash(hash.data(), hash.size(), body.data(), body.size(), nullptr, 0);
  std::uint64_t digest = 0;
  for (std::size_t i = 0; i < 8; ++i) digest = digest << 8 | hash[i];
  return static_cast<std::int64_t>(digest);
}

}  // namespace axlecast
