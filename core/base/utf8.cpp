#include "core/base/utf8.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace axlecast {

std::size_t CharacterSize(std::uint8_t lead) {
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return 2;
  if (lead >= 0xE0 && lead <= 0xEF) return 3;
  return lead >= 0xF0 && lead <= 0xF4 ? 4 : 0;
}

Utf8Character FirstCharacter(std::string_view text) {
  const auto lead = static_cast<std::uint8_t>(text.front());
  const std::size_t size = CharacterSize(lead);
  if (size == 1) return {lead, 1};
  if (size == 0 || text.size() < size) return {};
  char32_t code = lead & (0xFFU >> (size + 1));
  for (const char byte : text.substr(1, size - 1)) {
    if (!IsContinuation(byte)) return {};
    code = code << 6U | (static_cast<std::uint8_t>(byte) & 0x3FU);
  }
  const bool overlong = (size == 3 && code < 0x800) || (size == 4 && code < 0x10000);
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (overlong || surrogate || code > 0x10FFFF) return {};
  return {code, size};
}

// By the JSON library, whose strings are UTF-8.
std::string MendedUtf8(std::string_view text) {
  using Json = nlohmann::json;
  const bool ascii = std::all_of(text.begin(), text.end(), [](char c) { return (c & 0x80) == 0; });
  if (ascii) return std::string(text);
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

}  // namespace axlecast
