#include "core/config/includes.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "core/base/text.h"
#include "core/config/abbreviations.h"
#include "core/config/yaml_entries.h"
#include "core/config/yaml_text.h"

namespace axlecast {
namespace {

constexpr const char* kInclude = "include";
constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

// Mappings that several files may share, as paths with * for any name. All mappings at the top level are shared too.
constexpr std::array<std::string_view, 10> kShared = {
    "buses.*",        "buses.*.devices",       "buses.*.defaults", "buses.*.simulate",
    "defaults.*",     "defaults.*.devices",    "bridge.keys",      "recorder.logs",
    "mqtt.positions", "mqtt.positions.devices"};

// The place of a mapping in the document: its keys from the top.
using Place = std::vector<std::string>;

std::string PathText(const Place& place) {
  std::string path;
  for (const std::string& key : place) path += (path.empty() ? "" : ".") + key;
  return path;
}

bool Matches(std::string_view pattern, const Place& place) {
  std::size_t begin = 0;
  for (const std::string& key : place) {
    if (begin > pattern.size()) return false;
    const std::size_t end = std::min(pattern.find('.', begin), pattern.size());
    const std::string_view part = pattern.substr(begin, end - begin);
    if (part != "*" && part != key) return false;
    begin = end + 1;
  }
  return begin == pattern.size() + 1;
}

bool IsShared(const Place& place) {
  return place.size() <= 1 ||
         std::any_of(kShared.begin(), kShared.end(), [&](std::string_view each) { return Matches(each, place); });
}

// Not Quoted: a path that is cut helps nobody.
std::string InQuotes(const std::string& path) { return '\'' + path + '\''; }

// Returns the path of a file that a file includes, without links resolved.
std::string PathOf(const std::string& including, const std::string& included) {
  const std::filesystem::path folder = std::filesystem::path(including).parent_path();
  return (folder / included).lexically_normal().string();
}

int Lines(const std::string& text) { return static_cast<int>(std::count(text.begin(), text.end(), '\n')) + 1; }

class Includer {
 public:
  Includer(const ConfigReader& read, ConfigErrors& errors) : read_(read), errors_(errors) {}

  // Returns nothing defined after an error.
  MachineDocument Read(const std::string& file) {
    Result<std::string> text = read_(file);
    if (!text) {
      errors_.Add(YAML::Mark::null_mark(), text.error().text);
      return {};
    }
    const YAML::Node document = ParseYaml(*text, errors_);
    if (!document.IsDefined() || !document.IsMap() || !document[kInclude].IsDefined())
      return {document, *std::move(text), {}};
    maker_.Adopt(document);
    next_line_ = Lines(*text);
    size_ = text->size();
    chain_.push_back(std::filesystem::path(file).lexically_normal().string());
    seen_.insert(chain_.back());
    sources_.push_back({file, *std::move(text)});
    const std::size_t errors_before = errors_.list().size();
    const YAML::Node whole = Whole(document, file);
    if (errors_.list().size() != errors_before) return {};
    std::string joined = TextOf(whole);
    if (errors_.list().size() != errors_before) return {};
    return {whole, std::move(joined), std::move(sources_)};
  }

 private:
  // Returns the document with the files of its `include` in it.
  YAML::Node Whole(const YAML::Node& document, const std::string& file) {
    std::vector<YamlEntry> entries = EntriesOf(document);
    const auto include = std::find_if(entries.begin(), entries.end(),
                                      [](const YamlEntry& entry) { return IsKey(entry.first, kInclude); });
    if (include == entries.end()) return document;
    std::vector<YamlEntry> others;
    std::copy_if(entries.begin(), entries.end(), std::back_inserter(others),
                 [](const YamlEntry& entry) { return !IsKey(entry.first, kInclude); });
    YAML::Node whole = maker_.MapOf(others);
    const YAML::Node& list = include->second;
    if (!list.IsSequence() || list.size() == 0) {
      errors_.Add(include->first.Mark(), "include: needs a list of files, for example [axes.yaml, motors.yaml]");
      return whole;
    }
    for (const auto& name : list) {
      const YAML::Node included = Included(name, file);
      if (!included.IsDefined()) continue;
      // Not assigned: that would change the document that `whole` is in.
      whole.reset(Merged(whole, included, {}));
    }
    return whole;
  }

  // Reads one file of a list; undefined after an error.
  YAML::Node Included(const YAML::Node& name, const std::string& including) {
    const YAML::Node nothing(YAML::NodeType::Undefined);
    const auto fail = [&](const std::string& text) {
      errors_.Add(name.Mark(), "include: " + text);
      return nothing;
    };
    if (!name.IsScalar() || name.Scalar().empty() || name.Scalar().find('\0') != std::string::npos)
      return fail("needs a list of files, for example [axes.yaml]");
    const std::string path = PathOf(including, name.Scalar());
    if (std::find(chain_.begin(), chain_.end(), path) != chain_.end())
      return fail(InQuotes(path) + " includes itself" +
                  (chain_.back() == path ? "" : ", over " + InQuotes(chain_.back())) +
                  ": remove one of the two lines");
    if (!seen_.insert(path).second) return fail(InQuotes(path) + " is included already: name each file once");
    if (chain_.size() > kMaxIncludeDepth)
      return fail(InQuotes(path) + " is nested deeper than " + std::to_string(kMaxIncludeDepth) +
                  " files: name it in the machine's file itself");
    if (sources_.size() > kMaxIncludedFiles)
      return fail("more than " + std::to_string(kMaxIncludedFiles) + " files: join some of them");
    Result<std::string> text = read_(path);
    if (!text) return fail(InQuotes(path) + ' ' + text.error().text + Remedy(text.error().text, including));
    size_ += text->size();
    if (size_ > kMaxIncluded)
      return fail(InQuotes(path) + ": the files of this machine have more than " + std::to_string(kMaxIncluded) +
                  " bytes together: use ranges and defaults, or describe two machines");
    return Parsed(path, *std::move(text));
  }

  static std::string Remedy(const std::string& error, const std::string& including) {
    if (!error.starts_with("cannot be read")) return "";
    return ": create it, or correct its name, which counts from the folder of " + including;
  }

  // The marks of a file follow those of the files before it, so that a mark names its file.
  YAML::Node Parsed(const std::string& path, std::string text) {
    const int begin = next_line_;
    next_line_ += Lines(text);
    errors_.AddFile(path, begin);
    const std::string_view content =
        std::string_view(text).substr(text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0);
    const YAML::Node document =
        ParseYaml(std::string(static_cast<std::size_t>(begin), '\n').append(content), errors_);
    sources_.push_back({path, std::move(text)});
    if (!document.IsDefined()) return document;
    maker_.Adopt(document);
    if (!document.IsMap()) {
      errors_.Add(document.Mark(), "an included file needs mappings as the machine's file has, for example buses:");
      return YAML::Node(YAML::NodeType::Undefined);
    }
    chain_.push_back(path);
    const YAML::Node whole = Whole(document, path);
    chain_.pop_back();
    return whole;
  }

  // Returns the keys of both mappings. `place`: of the two mappings in the document.
  YAML::Node Merged(const YAML::Node& first, const YAML::Node& second, const Place& place) {
    const std::vector<YamlEntry> added = EntriesOf(second);
    std::map<std::string, const YamlEntry*, std::less<>> rest;  // of `added`, by key
    for (const YamlEntry& entry : added) rest.emplace(entry.first.Scalar(), &entry);
    std::vector<YamlEntry> entries;
    for (const YamlEntry& entry : EntriesOf(first)) {
      const auto same = rest.find(entry.first.Scalar());
      if (same == rest.end()) {
        entries.push_back(entry);
        continue;
      }
      Place below = place;
      below.push_back(entry.first.Scalar());
      entries.emplace_back(entry.first, Joined(entry, *same->second, below));
      rest.erase(same);
    }
    for (const YamlEntry& entry : added) {
      if (rest.contains(entry.first.Scalar())) entries.push_back(entry);
    }
    return maker_.MapOf(entries);
  }

  // Returns the value of a key that two files have.
  YAML::Node Joined(const YamlEntry& first, const YamlEntry& second, const Place& place) {
    if (first.second.IsMap() && second.second.IsMap() && IsShared(place))
      return Merged(first.second, second.second, place);
    errors_.Add(second.first.Mark(), PathText(place) + ": is given here and in " +
                                         errors_.PlaceText(first.first.Mark(), second.first.Mark()) +
                                         ": remove one of the two");
    return first.second;
  }

  // Returns the whole document as one text, which the limits of one file apply to.
  std::string TextOf(const YAML::Node& whole) {
    std::string text = "# ";
    for (const ConfigSource& source : sources_)
      text += (source.file == sources_.front().file ? "" : ", ") + TerminalText(source.file, TextShape::kOneLine);
    text += ", as one file\n" + YamlText(whole);
    ConfigErrors limits("");
    static_cast<void>(ParseYaml(text, limits));
    for (const ConfigError& error : limits.list())
      errors_.Add(YAML::Mark::null_mark(), "with the files that it includes: " + error.text);
    return text;
  }

  const ConfigReader& read_;
  ConfigErrors& errors_;
  YamlMaker maker_;
  int next_line_ = 0;     // of the marks of the next file
  std::size_t size_ = 0;  // bytes of all files
  std::vector<ConfigSource> sources_;
  std::vector<std::string> chain_;  // the files that are being read, the outermost first
  std::set<std::string> seen_;
};

}  // namespace

MachineDocument ReadMachineFile(const std::string& file, const ConfigReader& read, ConfigErrors& errors) {
  errors.Asked({.place = kInclude, .kind = "list of texts"});
  return Includer(read, errors).Read(file);
}

MachineDocument ParseMachineText(const std::string& text, ConfigErrors& errors) {
  const YAML::Node document = ParseYaml(text, errors);
  if (!document.IsDefined() || !document.IsMap() || !document[kInclude].IsDefined()) return {document, text, {}};
  errors.Add(document[kInclude].Mark(),
             "include: only a file can include files: axlecast check-config --expand prints it as one text");
  return {};
}

MachineDocument ReadAgain(const MachineConfig& machine, ConfigErrors& errors) {
  if (machine.sources.empty()) return ParseMachineText(machine.text, errors);
  const ConfigReader again = [&machine](const std::string& file) -> Result<std::string> {
    const auto found = std::find_if(machine.sources.begin(), machine.sources.end(),
                                    [&file](const ConfigSource& source) { return source.file == file; });
    if (found == machine.sources.end()) return Failure("was not read");
    return found->text;
  };
  return ReadMachineFile(machine.sources.front().file, again, errors);
}

}  // namespace axlecast
