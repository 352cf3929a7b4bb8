#include "tools/text/utf8.h"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace axlecast {

// By the JSON library, whose strings are UTF-8.
std::string MendedUtf8(std::string_view text) {
  using Json = nlohmann::json;
  const bool ascii = std::all_of(text.begin(), text.end(), [](char c) { return (c & 0x80) == 0; });
  if (ascii) return std::string(text);
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

}  // namespace axlecast
