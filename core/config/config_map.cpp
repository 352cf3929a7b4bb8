#include "core/config/config_map.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <sstream>
#include <tuple>

#include "core/base/spelling.h"
#include "core/base/text.h"

namespace axlecast {
namespace {

// Further errors are dropped.
constexpr std::size_t kMaxErrors = 200;

constexpr std::string_view kGivenName = "<name>";

std::string KindOf(const YAML::Node& node) {
  if (node.IsMap()) return "a mapping";
  if (node.IsSequence()) return "a list";
  if (node.IsScalar()) return Quoted(node.Scalar());
  return "nothing";
}

// A mapping that ExpandAbbreviations has made has no mark; its first keys usually have one.
YAML::Mark MarkOf(const YAML::Node& node) {
  if (!node.IsDefined()) return YAML::Mark::null_mark();
  if (!node.IsMap() || !node.Mark().is_null() || node.size() == 0) return node.Mark();
  return node.begin()->first.Mark();
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

// Also with a plus sign, and in hex: 0x1F.
std::optional<std::int64_t> ParseWhole(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  if (!text.starts_with("0x") && !text.starts_with("0X")) return ParseInteger(text);
  text.remove_prefix(2);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc() || end != text.data() + text.size() || text.starts_with('-')) return std::nullopt;
  return value;
}

}  // namespace

void ConfigErrors::AddFile(const std::string& file, int begin) {
  const bool known =
      std::any_of(files_.begin() + 1, files_.end(), [begin](const File& f) { return f.begin == begin; });
  if (!known) files_.push_back({file, begin, 1});
}

const ConfigErrors::File& ConfigErrors::FileOf(int line) const {
  return *std::prev(std::upper_bound(files_.begin() + 1, files_.end(), line,
                                     [](int number, const File& file) { return number < file.begin; }));
}

ConfigErrors::Place ConfigErrors::PlaceOf(const YAML::Mark& mark) const {
  if (mark.is_null() || mark.line < 0) return {};
  const File& file = FileOf(mark.line);
  return {&file == &files_.front() ? "" : file.name, mark.line - file.begin + file.first_line};
}

std::string ConfigErrors::PlaceText(const YAML::Mark& mark, const YAML::Mark& from) const {
  const Place place = PlaceOf(mark);
  const std::string& name = place.file.empty() ? files_.front().name : place.file;
  const bool elsewhere = place.file != PlaceOf(from).file;
  if (place.line == 0) return "an earlier line";
  return "line " + std::to_string(place.line) + (elsewhere ? " of " + name : "");
}

std::size_t ConfigErrors::RankOf(const ConfigError& error) const {
  if (error.file.empty()) return 0;
  const auto found = std::find_if(files_.begin() + 1, files_.end(),
                                  [&error](const File& file) { return file.name == error.file; });
  return static_cast<std::size_t>(found - files_.begin());
}

void ConfigErrors::Add(const YAML::Mark& mark, std::string text) {
  Place place = PlaceOf(mark);
  ConfigError error;
  error.line = place.line;
  if (place.line > 0) error.column = mark.column + 1;  // yaml-cpp counts from 0
  error.text = std::move(text);
  error.file = std::move(place.file);
  Insert(std::move(error));
}

void ConfigErrors::AddOfLastFile(std::string text) {
  ConfigError error;
  error.text = std::move(text);
  if (files_.size() > 1) error.file = files_.back().name;
  Insert(std::move(error));
}

void ConfigErrors::Insert(ConfigError error) {
  if (errors_.size() >= kMaxErrors) return;
  error.text = TerminalText(error.text, TextShape::kOneLine);  // keys and values of the file may hold anything
  const auto place = std::upper_bound(errors_.begin(), errors_.end(), error, [this](const auto& a, const auto& b) {
    return std::tuple(RankOf(a), a.line, a.column) < std::tuple(RankOf(b), b.line, b.column);
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
  std::string text;
  for (const ConfigError& error : errors_) {
    text += TerminalText(error.file.empty() ? files_.front().name : error.file, TextShape::kOneLine);
    if (error.line > 0) text += ':' + std::to_string(error.line) + ':' + std::to_string(error.column);
    text += ": " + error.text + '\n';
  }
  return text;
}

ConfigMap::ConfigMap(YAML::Node node, std::string path, ConfigErrors& errors)
    : ConfigMap(Entry{node, MarkOf(node)}, path, path, errors) {}

ConfigMap::ConfigMap(const Entry& entry, std::string path, std::string place, ConfigErrors& errors)
    : node_(entry.value), mark_(entry.mark), path_(std::move(path)), place_(std::move(place)), errors_(&errors) {
  if (!node_.IsDefined() || node_.IsNull() || node_.IsMap()) return;
  errors_->Add(mark_, (path_.empty() ? "the file" : path_) + ": " + KindOf(node_) +
                          " is given where a mapping (key: value) is expected");
}

ConfigMap::Entry ConfigMap::Find(std::string_view key) {
  known_.emplace(key);
  const YAML::Node& node = node_;
  if (node.IsMap()) {
    for (const auto& pair : node) {
      if (!pair.first.IsScalar() || pair.first.Scalar() != key) continue;
      // An empty value's own mark is somewhere behind it.
      const YAML::Mark mark = pair.second.IsNull() ? YAML::Mark::null_mark() : MarkOf(pair.second);
      return {pair.second, !mark.is_null() ? mark : pair.first.Mark().is_null() ? mark_ : pair.first.Mark()};
    }
  }
  return {YAML::Node(YAML::NodeType::Undefined), mark_};
}

std::optional<std::string> ConfigMap::Scalar(std::string_view key, std::string_view expected) {
  const Entry entry = Find(key);
  if (!entry.value.IsDefined()) return std::nullopt;
  if (entry.value.IsScalar()) return entry.value.Scalar();
  Error(key, KindOf(entry.value) + " is given where " + std::string(expected) + " is expected");
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

template <typename Value, typename Parse>
Value ConfigMap::Parsed(std::string_view key, Value fallback, const std::string& expected, const std::string& right,
                        Parse parse) {
  const std::optional<std::string> text = Scalar(key, expected);
  if (!text) return fallback;
  const std::optional<Value> value = parse(*text);
  if (!value) Wrong(Find(key).mark, key, *text, right);
  return value.value_or(fallback);
}

template <typename Value, typename Parse, typename Format>
Value ConfigMap::Ranged(std::string_view key, Value fallback, Value min, Value max, std::string_view unit,
                        const std::string& kind, Parse parse, Format format) {
  const std::string range = Range(format(min), format(max), unit);
  const std::string expected = "a " + kind + " (" + range + ")";
  Asked(key, kind, range, fallback < min || fallback > max ? "" : format(fallback));
  const std::optional<std::string> text = Scalar(key, expected);
  if (!text) return fallback;
  const std::optional<Value> value = parse(*text);
  if (value && *value >= min && *value <= max) return *value;
  Wrong(Find(key).mark, key, *text, value ? "within " + range : expected);
  return fallback;
}

double ConfigMap::Number(std::string_view key, double fallback, double min, double max, std::string_view unit) {
  return Ranged(key, fallback, min, max, unit, "number", ParseNumber, Plain);
}

std::int64_t ConfigMap::Integer(std::string_view key, std::int64_t fallback, std::int64_t min, std::int64_t max,
                                std::string_view unit) {
  const auto format = [](std::int64_t value) { return std::to_string(value); };
  return Ranged(key, fallback, min, max, unit, "whole number", ParseWhole, format);
}

MonoNs ConfigMap::Time(std::string_view key, MonoNs fallback) {
  Asked(key, "time", {}, fallback == 0 ? "" : FormatTime(fallback));
  return Parsed(key, fallback, "a time", kTimeRule, ParseTime);
}

std::int64_t ConfigMap::Size(std::string_view key, std::int64_t fallback) {
  Asked(key, "size", {}, fallback == 0 ? "" : FormatSize(fallback));
  return Parsed(key, fallback, "a size", kSizeRule, ParseSize);
}

std::size_t ConfigMap::Choice(std::string_view key, const std::vector<std::string_view>& names,
                              std::size_t fallback) {
  const std::vector<std::string> words(names.begin(), names.end());
  const std::string right = "one of " + Listed(words);
  Asked(key, "word", Listed(words), fallback < words.size() ? words[fallback] : std::string());
  const std::optional<std::string> text = Scalar(key, right);
  if (!text) return fallback;
  const auto found = std::find(words.begin(), words.end(), *text);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  Wrong(Find(key).mark, key, *text, right + Suggestion(*text, words, ""));
  return fallback;
}

std::optional<YAML::Node> ConfigMap::Sequence(std::string_view key, const std::string& expected) {
  const Entry entry = Find(key);
  if (!entry.value.IsDefined()) return std::nullopt;
  if (entry.value.IsSequence()) return entry.value;
  Error(key, KindOf(entry.value) + " is given where " + expected);
  return std::nullopt;
}

std::vector<std::int64_t> ConfigMap::Integers(std::string_view key, std::int64_t min, std::int64_t max) {
  std::vector<std::int64_t> values;
  Asked(key, "list of whole numbers", Range(std::to_string(min), std::to_string(max), ""));
  const std::string right = "a whole number (" + Range(std::to_string(min), std::to_string(max), "") + ")";
  const auto list = Sequence(key, "a list is expected: [" + right + ", ...]");
  if (!list) return values;
  for (const auto& item : *list) {
    const std::optional<std::int64_t> value = item.IsScalar() ? ParseWhole(item.Scalar()) : std::nullopt;
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
  const auto list = Sequence(key, "a list is expected: [a, b]");
  if (!list) return values;
  for (const auto& item : *list) {
    if (!item.IsScalar()) {
      Wrong(item.Mark(), key, "", "a text");
    } else if (std::find(values.begin(), values.end(), item.Scalar()) != values.end()) {
      errors_->Add(item.Mark(), Path(key) + ": " + Quoted(item.Scalar()) + " is given twice");
    } else {
      values.push_back(item.Scalar());
    }
  }
  if (list->size() == 0) Error(key, "is empty: name at least one, or leave the key out");
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

std::string ConfigMap::File(std::string_view key, const std::string& example) {
  std::string file = String(key, "");
  if (Has(key) && !file.starts_with('/')) Error(key, Quoted(file) + " is no absolute path, e.g. " + example);
  return file;
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
  const auto items = Sequence(key, "a list of mappings is expected: [{...}, ...]");
  if (!items) return list;
  for (const YAML::Node& item : *items) {
    list.push_back(ConfigMap(Entry{item, item.Mark()}, Path(key) + '[' + std::to_string(list.size()) + ']',
                             Below(place_, key) + "[]", *errors_));
  }
  return list;
}

void ConfigMap::Error(std::string_view key, const std::string& text) {
  errors_->Add(Find(key).mark, Path(key) + ": " + text);
}

void ConfigMap::CheckName(const std::string& name) {
  if (!IsName(name)) ErrorHere(Quoted(name) + kNameRule);
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
  errors_->Add(mark, (path_.empty() ? "" : path_ + ": ") + "unknown key " + Quoted(key) +
                         Suggestion(key, known, "; known here: " + Listed(known)));
}

int ConfigMap::line() const { return errors_->PlaceOf(mark_).line; }

SecretPlace LoadPlace(ConfigMap& map, const std::string& example) {
  SecretPlace place;
  place.file = map.File("file", example);
  place.credential = map.String("credential", "");
  if (!place.file.empty() && !place.credential.empty()) {
    map.Error("credential", "is given together with file: it is read from one of them; leave the other out");
  }
  if (map.Has("credential") && (place.credential.empty() || place.credential.find('/') != std::string::npos)) {
    map.Error("credential", Quoted(place.credential) + " is no name below $CREDENTIALS_DIRECTORY, without '/'");
  }
  return place;
}

SecretPlace LoadSecret(ConfigMap& map, const std::string& key, const std::string& example) {
  if (!map.Has(key)) return {};
  const std::string rule = "names no place: {file: " + example + "} or {credential: NAME}";
  if (!map.node()[key].IsMap()) {
    map.Error(key, rule);
    return {};
  }
  ConfigMap keys = map.Map(key);
  SecretPlace place = LoadPlace(keys, example);
  if (place.empty()) map.Error(key, rule);
  keys.Done();
  return place;
}

}  // namespace axlecast
