#include "core/config/config_map.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <sstream>

#include "core/base/safe_text.h"
#include "core/base/spelling.h"

namespace axlecast {
namespace {

// A file that is wrong all over says so often enough with these.
constexpr std::size_t kMaxErrors = 200;

constexpr std::string_view kGivenName = "<name>";

std::string KindOf(const YAML::Node& node) {
  if (node.IsMap()) return "a mapping";
  if (node.IsSequence()) return "a list";
  if (node.IsScalar()) return Quoted(node.Scalar());
  return "nothing";
}

std::string Plain(double number) {
  std::ostringstream text;
  text.precision(12);
  text << number;
  return text.str();
}

std::string Below(const std::string& outer, std::string_view key) {
  return (outer.empty() ? "" : outer + '.') + std::string(key);
}

std::string Range(const std::string& min, const std::string& max, std::string_view unit) {
  std::string text = min + " to " + max;
  if (!unit.empty()) text.append(" ").append(unit);
  return text;
}

std::optional<double> ParseNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<std::int64_t> ParseInteger(std::string_view text) {
  int base = 10;
  if (text.starts_with('+')) text.remove_prefix(1);
  if (text.starts_with("0x") || text.starts_with("0X")) {
    text.remove_prefix(2);
    base = 16;
    if (text.starts_with('-')) return std::nullopt;
  }
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::vector<std::string> Words(const std::vector<std::string_view>& views) { return {views.begin(), views.end()}; }

}  // namespace

void ConfigErrors::Add(const YAML::Mark& mark, std::string text) {
  if (errors_.size() >= kMaxErrors) return;
  ConfigError error;
  if (!mark.is_null() && mark.line >= 0) {  // yaml-cpp counts from 0
    error.line = mark.line + first_line_;
    error.column = mark.column + 1;
  }
  error.text = TerminalText(text, TextShape::kOneLine);  // keys and values of the file may hold anything
  const auto place = std::upper_bound(errors_.begin(), errors_.end(), error, [](const auto& a, const auto& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  // Two readers of one mapping find the same.
  if (place != errors_.begin() && std::prev(place)->line == error.line && std::prev(place)->text == error.text)
    return;
  errors_.insert(place, std::move(error));
}

void ConfigErrors::Asked(ConfigKey key) {
  const auto same =
      std::find_if(keys_.begin(), keys_.end(), [&](const ConfigKey& k) { return k.place == key.place; });
  if (same == keys_.end()) return keys_.push_back(std::move(key));
  const bool required = same->required || key.required;
  if (!key.kind.empty()) *same = std::move(key);
  same->required = required;
}

std::string ConfigErrors::Text() const {
  const std::string file = TerminalText(file_, TextShape::kOneLine);
  std::string text;
  for (const ConfigError& error : errors_) {
    text += file;
    if (error.line > 0) text += ':' + std::to_string(error.line) + ':' + std::to_string(error.column);
    text += ": " + error.text + '\n';
  }
  return text;
}

ConfigMap::ConfigMap(YAML::Node node, std::string path, ConfigErrors& errors)
    : ConfigMap(Entry{node, node.IsDefined() ? node.Mark() : YAML::Mark::null_mark()}, path, path, errors) {}

ConfigMap::ConfigMap(const Entry& entry, std::string path, std::string place, ConfigErrors& errors)
    : node_(entry.value), mark_(entry.mark), path_(std::move(path)), place_(std::move(place)), errors_(&errors) {
  if (!node_.IsDefined() || node_.IsNull() || node_.IsMap()) return;
  errors_->Add(mark_, (path_.empty() ? "the file" : path_) + ": " + KindOf(node_) +
                          " stands where a mapping (key: value) is expected");
}

ConfigMap::Entry ConfigMap::Find(std::string_view key) {
  known_.emplace(key);
  const YAML::Node& node = node_;
  if (node.IsMap()) {
    for (const auto& pair : node) {
      if (!pair.first.IsScalar() || pair.first.Scalar() != key) continue;
      // An empty value's own mark is somewhere behind it.
      return {pair.second, pair.second.IsNull() ? pair.first.Mark() : pair.second.Mark()};
    }
  }
  return {YAML::Node(YAML::NodeType::Undefined), mark_};
}

std::optional<std::string> ConfigMap::Scalar(std::string_view key, std::string_view expected) {
  const Entry entry = Find(key);
  if (!entry.value.IsDefined()) return std::nullopt;
  if (entry.value.IsScalar()) return entry.value.Scalar();
  Error(key, KindOf(entry.value) + " stands where " + std::string(expected) + " is expected");
  return std::nullopt;
}

std::string ConfigMap::Path(std::string_view key) const { return Below(path_, key); }

void ConfigMap::Asked(std::string_view key, std::string kind, std::string range, std::string fallback) {
  errors_->Asked({.place = Below(place_, key),
                  .kind = std::move(kind),
                  .range = std::move(range),
                  .fallback = std::move(fallback)});
}

void ConfigMap::Wrong(const YAML::Mark& mark, std::string_view key, std::string_view value,
                      const std::string& right) {
  errors_->Add(mark, Path(key) + ": " + Quoted(value) + " is not " + right);
}

bool ConfigMap::Has(std::string_view key) {
  Asked(key, {});
  return Find(key).value.IsDefined();
}

void ConfigMap::MarkRequired(std::string_view key) {
  errors_->Asked({.place = Below(place_, key), .required = true});
}

bool ConfigMap::Require(std::string_view key, const std::string& right) {
  MarkRequired(key);
  const bool given = Has(key);
  if (!given) Error(key, "is missing" + (right.empty() ? "" : ": " + right));
  return given;
}

std::string ConfigMap::String(std::string_view key, std::string fallback) {
  Asked(key, "text", {}, fallback);
  return Scalar(key, "a text").value_or(std::move(fallback));
}

std::string ConfigMap::RequiredString(std::string_view key) {
  Require(key, "");
  return String(key, {});
}

bool ConfigMap::Bool(std::string_view key, bool fallback) {
  Asked(key, "true or false", {}, fallback ? "true" : "false");
  const std::optional<std::string> text = Scalar(key, "true or false");
  if (!text) return fallback;
  if (*text == "true") return true;
  if (*text != "false") Wrong(Find(key).mark, key, *text, "true or false");
  return *text == "false" ? false : fallback;
}

double ConfigMap::Number(std::string_view key, double fallback, double min, double max, std::string_view unit) {
  const std::string range = Range(Plain(min), Plain(max), unit);
  Asked(key, "number", range, fallback < min || fallback > max ? "" : Plain(fallback));
  const std::optional<std::string> text = Scalar(key, "a number (" + range + ")");
  if (!text) return fallback;
  const std::optional<double> value = ParseNumber(*text);
  if (value && *value >= min && *value <= max) return *value;
  Wrong(Find(key).mark, key, *text, value ? "within " + range : "a number (" + range + ")");
  return fallback;
}

std::int64_t ConfigMap::Integer(std::string_view key, std::int64_t fallback, std::int64_t min, std::int64_t max,
                                std::string_view unit) {
  const std::string range = Range(std::to_string(min), std::to_string(max), unit);
  Asked(key, "whole number", range, fallback < min || fallback > max ? "" : std::to_string(fallback));
  const std::optional<std::string> text = Scalar(key, "a whole number (" + range + ")");
  if (!text) return fallback;
  const std::optional<std::int64_t> value = ParseInteger(*text);
  if (value && *value >= min && *value <= max) return *value;
  Wrong(Find(key).mark, key, *text, value ? "within " + range : "a whole number (" + range + ")");
  return fallback;
}

MonoNs ConfigMap::Time(std::string_view key, MonoNs fallback) {
  Asked(key, "time", {}, fallback == 0 ? "" : FormatTime(fallback));
  const std::optional<std::string> text = Scalar(key, "a time");
  if (!text) return fallback;
  const std::optional<MonoNs> value = ParseTime(*text);
  if (!value) Wrong(Find(key).mark, key, *text, kTimeRule);
  return value.value_or(fallback);
}

std::int64_t ConfigMap::Size(std::string_view key, std::int64_t fallback) {
  Asked(key, "size", {}, fallback == 0 ? "" : FormatSize(fallback));
  const std::optional<std::string> text = Scalar(key, "a size");
  if (!text) return fallback;
  const std::optional<std::int64_t> value = ParseSize(*text);
  if (!value) Wrong(Find(key).mark, key, *text, kSizeRule);
  return value.value_or(fallback);
}

std::size_t ConfigMap::Choice(std::string_view key, const std::vector<std::string_view>& names,
                              std::size_t fallback) {
  const std::vector<std::string> words = Words(names);
  Asked(key, "word", Listed(words), fallback < words.size() ? words[fallback] : std::string());
  const std::optional<std::string> text = Scalar(key, "one of " + Listed(words));
  if (!text) return fallback;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == *text) return i;
  }
  const std::optional<std::string> near = NearestWord(*text, words);
  Wrong(Find(key).mark, key, *text,
        "one of " + Listed(words) + (near ? "; did you mean " + Quoted(*near) + "?" : ""));
  return fallback;
}

std::vector<std::int64_t> ConfigMap::Integers(std::string_view key, std::int64_t min, std::int64_t max) {
  std::vector<std::int64_t> values;
  Asked(key, "list of whole numbers", Range(std::to_string(min), std::to_string(max), ""));
  const Entry entry = Find(key);
  if (!entry.value.IsDefined()) return values;
  const std::string right = "a whole number (" + Range(std::to_string(min), std::to_string(max), "") + ")";
  if (!entry.value.IsSequence()) {
    Error(key, KindOf(entry.value) + " stands where a list is expected: [" + right + ", ...]");
    return values;
  }
  for (const auto& item : entry.value) {
    const std::optional<std::int64_t> value = item.IsScalar() ? ParseInteger(item.Scalar()) : std::nullopt;
    if (value && *value >= min && *value <= max) {
      values.push_back(*value);
    } else {
      Wrong(item.Mark(), key, item.IsScalar() ? item.Scalar() : "", right);
    }
  }
  return values;
}

std::vector<std::string> ConfigMap::Strings(std::string_view key) {
  std::vector<std::string> values;
  Asked(key, "list of texts");
  const Entry entry = Find(key);
  if (!entry.value.IsDefined()) return values;
  if (!entry.value.IsSequence()) {
    Error(key, KindOf(entry.value) + " stands where a list is expected: [a, b]");
    return values;
  }
  for (const auto& item : entry.value) {
    if (!item.IsScalar()) {
      Wrong(item.Mark(), key, "", "a text");
    } else if (std::find(values.begin(), values.end(), item.Scalar()) != values.end()) {
      errors_->Add(item.Mark(), Path(key) + ": " + Quoted(item.Scalar()) + " stands twice");
    } else {
      values.push_back(item.Scalar());
    }
  }
  if (entry.value.size() == 0) Error(key, "is empty: name at least one, or leave the key out");
  return values;
}

std::vector<std::uint8_t> ConfigMap::HexBytes(std::string_view key) {
  constexpr const char* kRight = "bytes in hex, two digits each: \"A1 05\"";
  std::vector<std::uint8_t> bytes;
  Asked(key, "bytes", "two hex digits each");
  const std::optional<std::string> text = Scalar(key, kRight);
  if (!text) return bytes;
  std::istringstream words(*text);
  for (std::string word; words >> word;) {
    std::uint8_t byte = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), byte, 16);
    if (word.size() != 2 || error != std::errc() || end != word.data() + word.size()) {
      Wrong(Find(key).mark, key, *text, kRight);
      return {};
    }
    bytes.push_back(byte);
  }
  if (bytes.empty()) Wrong(Find(key).mark, key, *text, kRight);
  return bytes;
}

ConfigMap ConfigMap::Map(std::string_view key) {
  Asked(key, "mapping");
  return {Find(key), Path(key), Below(place_, key), *errors_};
}

ConfigMap ConfigMap::Named(std::string_view name) {
  return {Find(name), Path(name), Below(place_, kGivenName), *errors_};
}

ConfigMap ConfigMap::Empty(std::string_view key) {
  return {Entry{YAML::Node(), mark_}, Path(key), Below(place_, key), *errors_};
}

std::vector<std::pair<std::string, ConfigMap>> ConfigMap::Maps(std::string_view key) {
  std::vector<std::pair<std::string, ConfigMap>> maps;
  const ConfigMap outer = Map(key);
  const YAML::Node& node = outer.node_;
  if (!node.IsMap()) return maps;
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) continue;  // ParseYaml has refused it
    const std::string& name = pair.first.Scalar();
    const std::string path = outer.path_ + '.' + name;
    const Entry entry{pair.second, pair.first.Mark()};
    if (pair.second.IsNull()) errors_->Add(entry.mark, path + ": is empty; a mapping (key: value) is expected");
    maps.emplace_back(name, ConfigMap(entry, path, Below(outer.place_, kGivenName), *errors_));
  }
  return maps;
}

std::vector<ConfigMap> ConfigMap::List(std::string_view key) {
  std::vector<ConfigMap> list;
  Asked(key, "list of mappings");
  const Entry entry = Find(key);
  if (!entry.value.IsDefined()) return list;
  if (!entry.value.IsSequence()) {
    Error(key, KindOf(entry.value) + " stands where a list of mappings is expected: [{...}, ...]");
    return list;
  }
  for (const YAML::Node& item : entry.value) {
    list.push_back(ConfigMap(Entry{item, item.Mark()}, Path(key) + '[' + std::to_string(list.size()) + ']',
                             Below(place_, key) + "[]", *errors_));
  }
  return list;
}

void ConfigMap::Error(std::string_view key, const std::string& text) {
  errors_->Add(Find(key).mark, Path(key) + ": " + text);
}

void ConfigMap::Done() {
  const YAML::Node& node = node_;
  if (!node.IsMap()) return;
  for (const auto& pair : node) {
    if (pair.first.IsScalar() && !known_.contains(pair.first.Scalar())) {
      ReportUnknown(pair.first.Scalar(), pair.first.Mark());
    }
  }
}

void ConfigMap::ReportUnknown(const std::string& key, const YAML::Mark& mark) {
  const std::vector<std::string> known(known_.begin(), known_.end());
  const std::optional<std::string> near = NearestWord(key, known);
  std::string text = (path_.empty() ? "" : path_ + ": ") + "unknown key " + Quoted(key);
  text += near ? "; did you mean " + Quoted(*near) + "?" : "; known here: " + Listed(known);
  errors_->Add(mark, text);
}

int ConfigMap::line() const { return mark_.is_null() ? 0 : mark_.line + 1; }

SecretPlace LoadPlace(ConfigMap& map, const std::string& example) {
  SecretPlace place;
  place.file = map.String("file", "");
  place.credential = map.String("credential", "");
  if (!place.file.empty() && !place.credential.empty()) {
    map.Error("credential", "stands beside file: it is read from one of them; leave the other out");
  }
  if (map.Has("file") && !place.file.starts_with('/')) {
    map.Error("file", Quoted(place.file) + " is no absolute path, e.g. " + example);
  }
  if (map.Has("credential") && (place.credential.empty() || place.credential.find('/') != std::string::npos)) {
    map.Error("credential", Quoted(place.credential) + " is no name below $CREDENTIALS_DIRECTORY, without '/'");
  }
  return place;
}

}  // namespace axlecast
