#include "core/config/yaml_entries.h"

#include <algorithm>

namespace axlecast {

std::vector<YamlEntry> EntriesOf(const YAML::Node& map) {
  std::vector<YamlEntry> entries;
  if (!map.IsDefined() || !map.IsMap()) return entries;
  for (const auto& entry : map) entries.emplace_back(entry.first, entry.second);
  return entries;
}

const YamlEntry* FindEntry(const std::vector<YamlEntry>& entries, std::string_view key) {
  const auto found =
      std::find_if(entries.begin(), entries.end(), [key](const YamlEntry& each) { return IsKey(each.first, key); });
  return found == entries.end() ? nullptr : &*found;
}

YAML::Node YamlMaker::Made(YAML::NodeType::value type) {
  const YAML::Node node(type);
  pool_.push_back(node);
  return node;
}

YAML::Node YamlMaker::MapOf(const std::vector<YamlEntry>& entries) {
  YAML::Node map = Made(YAML::NodeType::Map);
  for (const auto& [key, value] : entries) map.force_insert(key, value);
  return map;
}

}  // namespace axlecast
