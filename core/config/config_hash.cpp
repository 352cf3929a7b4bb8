#include "core/config/config_hash.h"

#include <map>
#include <string>

namespace axlecast {
namespace {

void AppendQuoted(std::string& text, const std::string& scalar) {
  text += '"';
  for (const char c : scalar) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  text += '"';
}

void Append(std::string& text, const YAML::Node& node) {
  if (node.IsMap()) {
    std::map<std::string, YAML::Node> entries;
    for (const auto& pair : node) entries.emplace(pair.first.Scalar(), pair.second);
    text += '{';
    for (const auto& [key, value] : entries) {
      if (text.back() != '{') text += ',';
      AppendQuoted(text, key);
      text += ':';
      Append(text, value);
    }
    text += '}';
  } else if (node.IsSequence()) {
    text += '[';
    for (const auto& item : node) {
      if (text.back() != '[') text += ',';
      Append(text, item);
    }
    text += ']';
  } else {
    AppendQuoted(text, node.IsScalar() ? node.Scalar() : "");
  }
}

}  // namespace

std::int64_t ConfigHash(const YAML::Node& device) {
  std::string text;
  Append(text, device);
  std::uint64_t hash = 0xCBF29CE484222325;  // FNV-1a, draft-eastlake-fnv, 64 bits
  for (const char c : text) {
    hash ^= static_cast<std::uint8_t>(c);
    hash *= 0x100000001B3;
  }
  return static_cast<std::int64_t>(hash);
}

}  // namespace axlecast
