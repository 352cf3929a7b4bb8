#include "tools/json/field.h"

#include <array>
#include <cmath>

namespace axlecast {
namespace {

// As LCM writes it: big-endian.
std::int64_t ReadInt64(Bytes bytes, std::size_t offset) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes.subspan(offset, 8)) value = (value << 8U) | byte;
  return static_cast<std::int64_t>(value);
}

}  // namespace

std::string HexDigits(Bytes bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  text.reserve(2 * bytes.size());
  for (const std::uint8_t byte : bytes) {
    text += kDigits[byte >> 4U];
    text += kDigits[byte & 0xFU];
  }
  return text;
}

nlohmann::ordered_json Field(double value) {
  if (!std::isfinite(value)) return nullptr;
  return value;
}

nlohmann::ordered_json BootIdField(std::int64_t boot_id) {
  std::array<std::uint8_t, 8> bytes{};
  auto rest = static_cast<std::uint64_t>(boot_id);
  for (std::size_t i = bytes.size(); i-- > 0; rest >>= 8U) bytes[i] = static_cast<std::uint8_t>(rest & 0xFFU);
  return HexDigits(bytes);
}

std::optional<std::int64_t> Fingerprint(Bytes message) {
  if (message.size() < 8) return std::nullopt;
  return ReadInt64(message, 0);
}

std::optional<MessageHead> ReadHead(Bytes message) {
  if (message.size() < 40) return std::nullopt;
  return MessageHead{.utime = ReadInt64(message, 8),
                     .mono_ns = ReadInt64(message, 16),
                     .boot_id = ReadInt64(message, 24),
                     .seq = ReadInt64(message, 32)};
}

nlohmann::ordered_json ParseOutsideJson(std::string_view text) {
  using Json = nlohmann::ordered_json;
  const auto shallow = [](int depth, Json::parse_event_t, Json&) { return depth < kDeepestJson; };
  return Json::parse(text, shallow, false);
}

std::string JsonLine(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace axlecast
