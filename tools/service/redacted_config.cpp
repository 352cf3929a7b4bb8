#include "tools/service/redacted_config.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <regex>
#include <string_view>

#include "core/config/yaml_text.h"

namespace axlecast {
namespace {

constexpr const char* kMask = "(masked)";

bool NamesSecret(std::string key) {
  std::transform(key.begin(), key.end(), key.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  constexpr std::array<std::string_view, 5> kWords = {"password", "passphrase", "secret", "token", "psk"};
  return std::any_of(kWords.begin(), kWords.end(),
                     [&key](std::string_view word) { return key.find(word) != std::string::npos; });
}

bool IsPlace(const std::string& key) { return key == "file" || key == "credential"; }

// Masks the part before the @ of URLs.
std::string WithoutUsers(const std::string& text) {
  static const std::regex kUser("//[^/@ ]*@");
  return std::regex_replace(text, kUser, std::string("//") + kMask + '@');
}

void Emit(YAML::Emitter& out, const YAML::Node& node, bool secret) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      out << (secret ? kMask : WithoutUsers(node.Scalar()));
      return;
    case YAML::NodeType::Sequence:
      out << YAML::BeginSeq;
      for (const YAML::Node& item : node) Emit(out, item, secret);
      out << YAML::EndSeq;
      return;
    case YAML::NodeType::Map:
      out << YAML::BeginMap;
      for (const auto& entry : node) {
        const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
        const bool place = IsPlace(key) && entry.second.IsScalar();
        out << YAML::Key << key << YAML::Value;
        Emit(out, entry.second, !place && (secret || NamesSecret(key)));
      }
      out << YAML::EndMap;
      return;
    default:
      out << YAML::Null;
  }
}

}  // namespace

std::string RedactedConfig(const std::string& text) {
  ConfigErrors errors("");
  const YAML::Node document = ParseYaml(text, errors);
  if (!errors.empty() || !document.IsDefined()) return "(the machine's file is no YAML)\n";  // an error quotes it
  YAML::Emitter out;
  Emit(out, document, false);
  return std::string(out.c_str()) + '\n';
}

}  // namespace axlecast
