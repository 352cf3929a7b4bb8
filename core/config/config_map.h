#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/secret.h"
#include "core/base/time.h"

namespace axlecast {

struct ConfigError {
  int line = 0;      // 1-based; 0: the file as a whole
  int column = 0;    // 1-based
  std::string text;  // names the key, the value found and what would be right
  std::string file;  // empty: the file that the errors are of; else one that it includes
};

// A key that was asked for, whether the file has it or not.
struct ConfigKey {
  std::string place;  // "buses.<name>.link.baud": names that the file gives are <name>
  std::string kind =
      {};  // "number", "whole number", "text", "mapping", ...; empty while only its presence was asked for
  std::string range = {};     // with its unit, or the words allowed; empty: any
  std::string fallback = {};  // what holds without it; empty: nothing, or it is required
  bool required = false;
};

// The errors of one file and of the files that it includes, in the order of their lines; and which keys it was asked for, in the order
// of asking.
class ConfigErrors {
 public:
  // A line of a file.
  struct Place {
    std::string file;  // as in ConfigError
    int line = 0;      // 1-based; 0: the file as a whole
  };

  // `first_line`: number of the first line of the YAML text within the file.
  explicit ConfigErrors(std::string file, int first_line = 1) {
    files_.push_back({std::move(file), 0, first_line});
  }

  // Assigns all marks from line `begin` (counted from 0) on to an included file, whose first line it is. Each file must begin behind the
  // last line of those before it. A file that was added before is left as it is.
  void AddFile(const std::string& file, int begin);
  [[nodiscard]] Place PlaceOf(const YAML::Mark& mark) const;
  // "line 7", with the name of the file if the mark is in another file than `from`.
  [[nodiscard]] std::string PlaceText(const YAML::Mark& mark, const YAML::Mark& from) const;

  void Add(const YAML::Mark& mark, std::string text);
  // Adds an error about the last file of AddFile as a whole.
  void AddOfLastFile(std::string text);
  [[nodiscard]] bool empty() const { return errors_.empty(); }
  [[nodiscard]] const std::vector<ConfigError>& list() const { return errors_; }
  [[nodiscard]] std::string Text() const;  // one "file:line:column: text" a line
  // Once for each place: what a later asking knows is added to what an earlier one knew.
  void Asked(ConfigKey key);
  [[nodiscard]] const std::vector<ConfigKey>& keys() const { return keys_; }

 private:
  struct File {
    std::string name;
    int begin = 0;       // its first line in the numbers of marks
    int first_line = 1;  // the number of that line for people
  };
  [[nodiscard]] const File& FileOf(int line) const;
  [[nodiscard]] std::size_t RankOf(const ConfigError& error) const;
  void Insert(ConfigError error);

  std::vector<File> files_;  // first the file itself, then those that it includes
  std::vector<ConfigError> errors_;
  std::vector<ConfigKey> keys_;
};

// One YAML mapping, read strictly: every key must be asked for, or Done() reports it as unknown with the nearest
// known key. A value that is missing, of the wrong kind or out of range is reported, and the default is returned.
class ConfigMap {
 public:
  ConfigMap(YAML::Node node, std::string path, ConfigErrors& errors);
  ConfigMap(const ConfigMap&) = default;
  ConfigMap& operator=(const ConfigMap&) = delete;  // YAML::Node's would change the document

  [[nodiscard]] bool Has(std::string_view key);
  // Notes for the list of keys that the key is required.
  void MarkRequired(std::string_view key);
  // An error, with what it should be, when the key is absent. Whether it is there.
  bool Require(std::string_view key, const std::string& right);
  [[nodiscard]] std::string String(std::string_view key, std::string fallback);
  [[nodiscard]] std::string RequiredString(std::string_view key);
  [[nodiscard]] bool Bool(std::string_view key, bool fallback);
  // `unit` is for the message only, e.g. "rpm".
  [[nodiscard]] double Number(std::string_view key, double fallback, double min, double max, std::string_view unit);
  [[nodiscard]] std::int64_t Integer(std::string_view key, std::int64_t fallback, std::int64_t min,
                                     std::int64_t max, std::string_view unit);
  // As ParseTime and ParseSize have them, "90s" and "20GB"; a fallback of 0 means no fallback.
  [[nodiscard]] MonoNs Time(std::string_view key, MonoNs fallback);
  [[nodiscard]] std::int64_t Size(std::string_view key, std::int64_t fallback);
  // Index into `names`; the fallback when the key is absent or wrong.
  [[nodiscard]] std::size_t Choice(std::string_view key, const std::vector<std::string_view>& names,
                                   std::size_t fallback);
  [[nodiscard]] std::vector<std::int64_t> Integers(std::string_view key, std::int64_t min, std::int64_t max);
  // A list of texts that holds at least one, and none twice.
  [[nodiscard]] std::vector<std::string> Strings(std::string_view key);
  [[nodiscard]] std::vector<std::uint8_t> HexBytes(std::string_view key);  // "A1 05"
  // An absolute path; "" without the key. `example` is for the message.
  [[nodiscard]] std::string File(std::string_view key, const std::string& example);
  // A mapping below; an empty one when the key is absent.
  [[nodiscard]] ConfigMap Map(std::string_view key);
  // The same of a mapping whose key is a name that the file gives, such as a device's.
  [[nodiscard]] ConfigMap Named(std::string_view name);
  // An empty mapping, whatever the file has at `key`.
  [[nodiscard]] ConfigMap Empty(std::string_view key);
  // The mappings of a mapping, in file order: name and content.
  [[nodiscard]] std::vector<std::pair<std::string, ConfigMap>> Maps(std::string_view key);
  [[nodiscard]] std::vector<ConfigMap> List(std::string_view key);  // a sequence of mappings

  // Adds an error at a key's value, or at the mapping if the key is absent.
  void Error(std::string_view key, const std::string& text);
  // Adds an error at the mapping.
  void ErrorHere(const std::string& text) { errors_->Add(mark_, path_ + ": " + text); }
  // Checks a name that the file gives to the mapping.
  void CheckName(const std::string& name);
  void Done();

  // Returns true if the file has the mapping, even if it is empty.
  [[nodiscard]] bool given() const { return node_.IsDefined() && (node_.IsMap() || node_.IsNull()); }
  [[nodiscard]] int line() const;
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] ConfigErrors& errors() { return *errors_; }
  [[nodiscard]] YAML::Node node() const { return node_; }

 private:
  struct Entry {
    YAML::Node value;  // undefined when the key is absent
    YAML::Mark mark;   // of the value, or of the mapping
  };
  ConfigMap(const Entry& entry, std::string path, std::string place, ConfigErrors& errors);

  [[nodiscard]] Entry Find(std::string_view key);
  // Returns the text of a scalar; nothing if the key is absent or, after an error, is something else than `expected`.
  [[nodiscard]] std::optional<std::string> Scalar(std::string_view key, std::string_view expected);
  // Returns the scalar as `parse` reads it; `fallback` if the key is absent or, after an error, `parse` returns nothing.
  template <typename Value, typename Parse>
  [[nodiscard]] Value Parsed(std::string_view key, Value fallback, const std::string& expected,
                             const std::string& right, Parse parse);
  template <typename Value, typename Parse, typename Format>
  [[nodiscard]] Value Ranged(std::string_view key, Value fallback, Value min, Value max, std::string_view unit,
                             const std::string& kind, Parse parse, Format format);
  // Returns a list; nothing if the key is absent or, after an error, is not a list.
  [[nodiscard]] std::optional<YAML::Node> Sequence(std::string_view key, const std::string& expected);
  [[nodiscard]] std::string Path(std::string_view key) const;
  // Notes the possible values of `key` in the list of keys.
  void Asked(std::string_view key, std::string kind, std::string range = {}, std::string fallback = {});
  void Wrong(const YAML::Mark& mark, std::string_view key, std::string_view value, const std::string& right);
  void ReportUnknown(const std::string& key, const YAML::Mark& mark);

  YAML::Node node_;
  YAML::Mark mark_;  // where the mapping begins
  std::string path_;
  std::string place_;  // as in ConfigKey
  ConfigErrors* errors_;
  std::set<std::string, std::less<>> known_;
};

// The keys `file` and `credential` of a mapping: at most one of them, or an error. `example`: an absolute path, for
// the message.
[[nodiscard]] SecretPlace LoadPlace(ConfigMap& map, const std::string& example);

// The place of a secret at `key`, a mapping as LoadPlace reads it; an empty one when the key is absent. A secret in the file itself
// is refused, and the error does not repeat it.
[[nodiscard]] SecretPlace LoadSecret(ConfigMap& map, const std::string& key, const std::string& example);

}  // namespace axlecast
