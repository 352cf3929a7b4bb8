#include "core/config/abbreviations.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <optional>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/config/yaml_entries.h"

namespace axlecast {
namespace {

constexpr const char* kMergeKey = "<<";
constexpr const char* kDefaults = "defaults";
constexpr const char* kDevices = "devices";
constexpr std::size_t kMaxNodes = 100'000;  // below `buses`, after ranges are replaced

// The number of a range, as in the name and without leading zeros.
struct RangeNumber {
  std::string padded;
  std::string plain;
};

// A range in a name: "axis{01..12}" has the names axis01 to axis12.
struct NameRange {
  std::string before;
  std::string after;
  std::int64_t first = 0;
  std::int64_t last = 0;
  std::size_t digits = 0;  // at least so many, with leading zeros

  [[nodiscard]] RangeNumber Number(std::int64_t number) const {
    const std::string plain = std::to_string(number);
    return {std::string(digits - std::min(digits, plain.size()), '0') + plain, plain};
  }
};

// Returns the range in `name`; nothing if it has none. The first of several counts, the name then still contains the others.
std::optional<NameRange> RangeIn(const std::string& name) {
  for (std::size_t open = name.find('{'); open != std::string::npos; open = name.find('{', open + 1)) {
    const std::size_t dots = name.find("..", open);
    const std::size_t close = name.find('}', open);
    if (dots == std::string::npos || close == std::string::npos || dots > close) continue;
    const std::string first = name.substr(open + 1, dots - open - 1);
    const std::string last = name.substr(dots + 2, close - dots - 2);
    const auto from = ParseInteger(first, 0, 99'999);
    const auto to = ParseInteger(last, 0, 99'999);
    if (!from || !to) continue;
    const bool padded = first.size() > 1 && first.front() == '0';
    return NameRange{name.substr(0, open), name.substr(close + 1), *from, *to, padded ? first.size() : 1};
  }
  return std::nullopt;
}

void ReplaceAll(std::string& text, std::string_view from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
}

class Expander {
 public:
  explicit Expander(ConfigErrors& errors) : errors_(errors) {}

  YAML::Node Expand(const YAML::Node& document) {
    maker_.Adopt(document);
    const std::vector<Entry> root = EntriesOf(Merged(document));
    const YAML::Node* const defaults = Find(root, kDefaults);
    if (defaults != nullptr && !defaults->IsNull() && !defaults->IsMap())
      errors_.Add(defaults->Mark(), "defaults: needs a mapping: a family, and keys of its buses and devices");
    const std::vector<Entry> families = defaults != nullptr ? EntriesOf(*defaults) : std::vector<Entry>();
    std::vector<std::string> used;
    std::vector<Entry> entries;
    for (const Entry& entry : root) {
      if (IsKey(entry.first, kDefaults)) continue;
      const bool buses = IsKey(entry.first, "buses") && entry.second.IsMap();
      entries.emplace_back(entry.first,
                           buses ? FilledBuses(Ranged(entry.second, nullptr), families, used) : entry.second);
    }
    for (const Entry& family : families) {
      if (family.first.IsScalar() && std::find(used.begin(), used.end(), family.first.Scalar()) != used.end())
        continue;
      errors_.Add(family.first.Mark(), "defaults: no bus of this file has the family " +
                                           Quoted(family.first.IsScalar() ? family.first.Scalar() : "") +
                                           ": correct its name, or remove it");
    }
    return MapOf(entries);
  }

 private:
  using Entry = YamlEntry;

  static const YAML::Node* Find(const std::vector<Entry>& entries, std::string_view key) {
    const Entry* const found = FindEntry(entries, key);
    return found == nullptr ? nullptr : &found->second;
  }
  static const YAML::Node* Find(const std::vector<Entry>& entries, const YAML::Node& key) {
    return key.IsScalar() ? Find(entries, key.Scalar()) : nullptr;
  }

  YAML::Node Made(YAML::NodeType::value type) { return maker_.Made(type); }
  YAML::Node MapOf(const std::vector<Entry>& entries) { return maker_.MapOf(entries); }

  // ---- merge keys ----

  // Keys of the mapping itself replace those of its merge key; of several merged mappings, the first counts.
  YAML::Node Merged(const YAML::Node& node) {
    if (node.IsSequence()) {
      YAML::Node list = Made(YAML::NodeType::Sequence);
      for (const auto& each : node) list.push_back(Merged(each));
      return list;
    }
    if (!node.IsMap()) return node;
    std::vector<Entry> entries;
    std::vector<YAML::Node> merged;
    for (const auto& entry : node) {
      if (!IsKey(entry.first, kMergeKey)) {
        entries.emplace_back(entry.first, Merged(entry.second));
      } else if (entry.second.IsMap()) {
        merged.push_back(entry.second);
      } else if (entry.second.IsSequence()) {
        for (const auto& each : entry.second) merged.push_back(each);
      } else {
        errors_.Add(entry.first.Mark(), "<<: needs a mapping, or a list of mappings: *name of an anchor");
      }
    }
    for (const YAML::Node& map : merged) {
      if (!map.IsMap()) {
        errors_.Add(map.Mark(), "<<: needs a mapping, or a list of mappings: *name of an anchor");
        continue;
      }
      for (const Entry& entry : EntriesOf(Merged(map))) {
        if (Find(entries, entry.first) == nullptr) entries.push_back(entry);
      }
    }
    return MapOf(entries);
  }

  // ---- ranges ----

  // `number`: of the range around the node; null outside of ranges.
  YAML::Node Ranged(const YAML::Node& node, const RangeNumber* number) {
    if (++nodes_ > kMaxNodes) return node;
    if (node.IsScalar()) return Substituted(node, number);
    if (node.IsSequence()) {
      YAML::Node list = Made(YAML::NodeType::Sequence);
      for (const auto& each : node) list.push_back(Ranged(each, number));
      return list;
    }
    if (!node.IsMap()) return node;
    YAML::Node map = Made(YAML::NodeType::Map);
    std::set<std::string> names;
    const auto add = [&](const YAML::Node& key, const YAML::Node& value, const YAML::Mark& mark) {
      if (key.IsScalar() && !names.insert(key.Scalar()).second)
        errors_.Add(mark, Quoted(key.Scalar()) + " is given twice: by a range and by another name or range");
      else
        map.force_insert(key, value);
    };
    for (const auto& entry : node) {
      const YAML::Mark mark = entry.first.Mark();
      const YAML::Node key = entry.first.IsScalar() ? Substituted(entry.first, number) : entry.first;
      const auto range = key.IsScalar() ? RangeIn(key.Scalar()) : std::nullopt;
      if (!range) {
        add(key, Ranged(entry.second, number), mark);
        continue;
      }
      if (range->last < range->first)
        errors_.Add(mark, Quoted(key.Scalar()) + " is a range that ends before it begins");
      for (std::int64_t i = range->first; i <= range->last && nodes_ <= kMaxNodes; ++i) {
        const RangeNumber here = range->Number(i);
        add(YAML::Node(range->before + here.padded + range->after), Ranged(entry.second, &here), mark);
      }
      if (nodes_ > kMaxNodes) {
        errors_.Add(mark, Quoted(key.Scalar()) + ": the ranges of the file make more than " +
                              std::to_string(kMaxNodes) + " values");
        break;
      }
    }
    return map;
  }

  static YAML::Node Substituted(const YAML::Node& scalar, const RangeNumber* number) {
    const std::string& text = scalar.Scalar();
    if (number == nullptr || (text.find("{}") == std::string::npos && text.find("{n}") == std::string::npos))
      return scalar;
    std::string made = text;
    ReplaceAll(made, "{}", number->padded);
    ReplaceAll(made, "{n}", number->plain);
    return YAML::Node(made);
  }

  // ---- defaults ----

  // Returns `own` with the keys of `fallback` that it lacks; mappings that both have are filled in the same way.
  YAML::Node Filled(const YAML::Node& own, const std::vector<Entry>& fallback) {
    if (fallback.empty() || (!own.IsMap() && !own.IsNull())) return own;
    const std::vector<Entry> given = EntriesOf(own);
    std::vector<Entry> entries;
    for (const Entry& entry : given) {
      const YAML::Node* const below = Find(fallback, entry.first);
      const bool both = below != nullptr && entry.second.IsMap() && below->IsMap();
      entries.emplace_back(entry.first, both ? Filled(entry.second, EntriesOf(*below)) : entry.second);
    }
    for (const Entry& entry : fallback) {
      if (Find(given, entry.first) == nullptr) entries.push_back(entry);
    }
    return MapOf(entries);
  }

  // `used`: the families of `families` that a bus has.
  YAML::Node FilledBuses(const YAML::Node& buses, const std::vector<Entry>& families,
                         std::vector<std::string>& used) {
    std::vector<Entry> entries;
    for (const Entry& bus : EntriesOf(buses)) {
      const std::vector<Entry> given = EntriesOf(bus.second);
      const YAML::Node* const family = Find(given, "family");
      const YAML::Node* const found = family != nullptr ? Find(families, *family) : nullptr;
      if (found != nullptr) used.push_back(family->Scalar());
      entries.emplace_back(bus.first, bus.second.IsMap() ? FilledBus(given, found != nullptr ? EntriesOf(*found)
                                                                                             : std::vector<Entry>())
                                                         : bus.second);
    }
    return MapOf(entries);
  }

  YAML::Node FilledBus(const std::vector<Entry>& bus, const std::vector<Entry>& family) {
    const auto keys_of = [](const std::vector<Entry>& entries, const char* name) {
      const YAML::Node* const found = Find(entries, name);
      return found != nullptr ? EntriesOf(*found) : std::vector<Entry>();
    };
    const std::vector<Entry> bus_device = keys_of(bus, kDefaults);
    const std::vector<Entry> family_device = keys_of(family, kDevices);
    std::vector<Entry> entries;
    for (const Entry& entry : bus) {
      if (IsKey(entry.first, kDefaults)) continue;
      if (!IsKey(entry.first, kDevices) || !entry.second.IsMap()) {
        entries.push_back(entry);
        continue;
      }
      std::vector<Entry> devices;
      for (const Entry& device : EntriesOf(entry.second))
        devices.emplace_back(device.first, Filled(Filled(device.second, bus_device), family_device));
      entries.emplace_back(entry.first, MapOf(devices));
    }
    std::vector<Entry> rest;
    std::copy_if(family.begin(), family.end(), std::back_inserter(rest),
                 [](const Entry& each) { return !IsKey(each.first, kDevices); });
    return Filled(MapOf(entries), rest);
  }

  ConfigErrors& errors_;
  std::size_t nodes_ = 0;
  YamlMaker maker_;
};

bool IsAbbreviated(const YAML::Node& node) {
  if (node.IsSequence())
    return std::any_of(node.begin(), node.end(), [](const auto& each) { return IsAbbreviated(each); });
  if (!node.IsMap()) return false;
  for (const auto& entry : node) {
    if (entry.first.IsScalar()) {
      const std::string& key = entry.first.Scalar();
      if (key == kMergeKey || key == kDefaults || RangeIn(key)) return true;
    }
    if (IsAbbreviated(entry.second)) return true;
  }
  return false;
}

}  // namespace

YAML::Node ExpandAbbreviations(const YAML::Node& document, ConfigErrors& errors) {
  errors.Asked({.place = "defaults", .kind = "mapping"});
  errors.Asked({.place = "buses.<name>.defaults", .kind = "mapping"});
  return document.IsMap() && IsAbbreviated(document) ? Expander(errors).Expand(document) : document;
}

std::string YamlText(const YAML::Node& document) {
  YAML::Emitter out;
  out << document;
  return std::string(out.c_str()) + '\n';
}

}  // namespace axlecast
