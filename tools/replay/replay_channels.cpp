#include "tools/replay/replay_channels.h"

#include <optional>
#include <utility>

#include "tools/log/log_header.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestExpression = 1'000;  // characters; the library's parser recurses

// Sets `problem` where `text` is no expression.
std::optional<std::regex> Compiled(const std::string& text, std::string& problem) {
  if (text.size() > kLongestExpression) {
    problem = "a regular expression of more than " + std::to_string(kLongestExpression) + " characters";
    return std::nullopt;
  }
  try {
    return std::regex(text, std::regex::ECMAScript | std::regex::optimize);
  } catch (const std::regex_error& error) {
    problem = "'" + text + "' is no regular expression: " + error.what();
    return std::nullopt;
  }
}

}  // namespace

std::string ReplayChannels::Select(const std::string& expression, bool invert) {
  std::string problem;
  std::optional<std::regex> compiled = Compiled(expression, problem);
  if (!compiled) return problem;
  selected_ = std::move(*compiled);
  selects_ = true;
  invert_ = invert;
  return "";
}

std::string ReplayChannels::Rename(const std::string& rule) {
  const std::size_t divide = rule.find('=');
  if (divide == std::string::npos || divide == 0) {
    return "'" + rule + "' is not OLD=NEW, e.g. '^POSITION/=RECORDED/POSITION/'";
  }
  std::string problem;
  std::optional<std::regex> compiled = Compiled(rule.substr(0, divide), problem);
  if (compiled) renames_.emplace_back(std::move(*compiled), rule.substr(divide + 1));
  return problem;
}

const ReplayChannels::Fate& ReplayChannels::Of(std::string_view channel) {
  if (const auto known = fates_.find(channel); known != fates_.end()) return known->second;
  const std::string name(channel);
  Fate fate;
  try {
    fate = Decide(name);
  } catch (const std::regex_error&) {
    // Too complex for this name: it is as if nothing were found.
  }
  return fates_.emplace(name, std::move(fate)).first->second;
}

ReplayChannels::Fate ReplayChannels::Decide(const std::string& channel) const {
  if (IsLogChannel(channel)) return {};
  if (selects_ && std::regex_search(channel, selected_) == invert_) return {};
  Fate fate{.selected = true, .name = channel, .command = CommandChannel::kNone};
  for (const auto& [old_name, new_name] : renames_) fate.name = std::regex_replace(fate.name, old_name, new_name);
  fate.name.insert(0, prefix_);
  fate.command = JudgeCommandChannel(fate.name);
  return fate;
}

}  // namespace axlecast
