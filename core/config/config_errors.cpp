#include <algorithm>
#include <iterator>

#include "core/base/terminal_text.h"
#include "core/config/config_map.h"

namespace axlecast {
namespace {

// A file that is wrong all over says so often enough with these.
constexpr std::size_t kMaxErrors = 200;

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

}  // namespace axlecast
