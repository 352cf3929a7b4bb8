#include "tools/axlecast/common/config_keys.h"

#include <algorithm>

#include "core/base/text.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::string KindOf(const ConfigKey& key) { return key.kind.empty() ? "text" : key.kind; }

std::string Default(const ConfigKey& key) {
  if (key.required) return "required";
  return key.fallback.empty() ? "" : "default " + key.fallback;
}

Json OrNull(const std::string& text) { return text.empty() ? Json() : Json(text); }

}  // namespace

std::string ConfigKeysText(const std::vector<ConfigKey>& keys) {
  constexpr std::size_t kKindWidth = 22;
  std::size_t width = 0;
  for (const ConfigKey& key : keys) width = std::max(width, key.place.size());
  std::string text;
  for (const ConfigKey& key : keys) {
    std::string line = Left(key.place, width) + "  " + Left(KindOf(key), kKindWidth) + Default(key);
    if (!key.range.empty()) line += (Default(key).empty() ? "" : "; ") + key.range;
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

Json ConfigKeysJson(const std::vector<ConfigKey>& keys) {
  Json list = Json::array();
  for (const ConfigKey& key : keys) {
    list.push_back({{"place", key.place},
                    {"kind", OrNull(key.kind)},
                    {"range", OrNull(key.range)},
                    {"default", OrNull(key.required ? "" : key.fallback)},
                    {"required", key.required}});
  }
  return list;
}

}  // namespace axlecast
