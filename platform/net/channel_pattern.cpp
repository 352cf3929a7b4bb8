#include "platform/net/channel_pattern.h"

#include <algorithm>
#include <utility>

namespace axlecast {
namespace {

constexpr std::string_view kAnything = ".*";
constexpr std::string_view kLineEnds = "\n\r";  // which `.` does not match

bool IsPlain(std::string_view text) { return text.find_first_of("\\^$.|?*+()[]{}") == std::string_view::npos; }

// Returns the texts of "text" or "(text|text)text"; no text for every other expression.
std::vector<std::string> TextsOf(std::string_view expression) {
  if (IsPlain(expression)) return {std::string(expression)};
  const std::size_t end = expression.find(')');
  if (!expression.starts_with('(') || end == std::string_view::npos) return {};
  const std::string_view rest = expression.substr(end + 1);
  std::string_view group = expression.substr(1, end - 1);
  std::vector<std::string> texts;
  for (bool last = false; !last;) {
    const std::size_t bar = group.find('|');
    const std::string_view text = group.substr(0, bar);
    if (!IsPlain(text) || !IsPlain(rest)) return {};
    texts.push_back(std::string(text).append(rest));
    last = bar == std::string_view::npos;
    group.remove_prefix(last ? group.size() : bar + 1);
  }
  return texts;
}

}  // namespace

std::optional<ChannelPattern> ChannelPattern::Of(const std::string& expression) {
  ChannelPattern pattern;
  std::string_view text = expression;
  pattern.open_ = text.ends_with(kAnything);
  if (pattern.open_) text.remove_suffix(kAnything.size());
  pattern.texts_ = TextsOf(text);
  if (!pattern.texts_.empty()) return pattern;
  try {
    pattern.regex_.emplace(expression, std::regex::ECMAScript | std::regex::optimize);
  } catch (const std::regex_error&) {
    return std::nullopt;
  }
  return pattern;
}

bool ChannelPattern::Matches(const std::string& name) const {
  if (regex_) {
    try {
      return std::regex_match(name, *regex_);
    } catch (const std::regex_error&) {
      return false;  // too complex for this name
    }
  }
  return std::ranges::any_of(texts_, [this, &name](const std::string& text) {
    if (!open_) return name == text;
    return name.starts_with(text) && name.find_first_of(kLineEnds, text.size()) == std::string::npos;
  });
}

}  // namespace axlecast
