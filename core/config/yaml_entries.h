#pragma once

#include <yaml-cpp/yaml.h>

#include <string_view>
#include <utility>
#include <vector>

namespace axlecast {

// Trees that are built from parts of parsed documents. A part keeps its line; a node that is made has none.

// Key and value of a mapping. Never assigned: an assignment of YAML::Node changes the node that it refers to, in every tree that
// has it.
using YamlEntry = std::pair<const YAML::Node, const YAML::Node>;

[[nodiscard]] inline bool IsKey(const YAML::Node& key, std::string_view name) {
  return key.IsScalar() && key.Scalar() == name;
}

// Returns the entries of a mapping, in its order; none of anything else.
[[nodiscard]] std::vector<YamlEntry> EntriesOf(const YAML::Node& map);

// Returns the first entry with this key, or null.
[[nodiscard]] const YamlEntry* FindEntry(const std::vector<YamlEntry>& entries, std::string_view key);

// Makes the nodes of a tree.
class YamlMaker {
 public:
  // Nodes of `document` will be parts of the tree. Without this, each node that is made would copy the bookkeeping of the whole document
  // with its first child: yaml-cpp merges the memory of a child into that of its parent.
  void Adopt(const YAML::Node& document) { pool_.push_back(document); }

  [[nodiscard]] YAML::Node Made(YAML::NodeType::value type);
  [[nodiscard]] YAML::Node MapOf(const std::vector<YamlEntry>& entries);

 private:
  YAML::Node pool_{YAML::NodeType::Sequence};  // every node that was made
};

}  // namespace axlecast
