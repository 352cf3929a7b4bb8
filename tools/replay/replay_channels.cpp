#include "tools/replay/replay_channels.h"

#include <optional>
#include <utility>

#include "core/base/expression.h"
#include "tools/log/log_header.h"

namespace axlecast {

std::string ReplayChannels::Rename(const std::string& rule) {
  const std::size_t divide = rule.find('=');
  if (divide == std::string::npos || divide == 0) {
    return "'" + rule + "' is not OLD=NEW, e.g. '^POSITION/=RECORDED/POSITION/'";
  }
  std::string problem;
  std::optional<std::regex> compiled = CompileExpression(rule.substr(0, divide), problem);
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

ReplayChannels::Fate ReplayChannels::Decide(const std::string& channel) {
  if (IsLogChannel(channel) || !filter_.Takes(channel)) return {};
  Fate fate{.selected = true, .name = channel, .command = CommandChannel::kNone};
  for (const auto& [old_name, new_name] : renames_) fate.name = std::regex_replace(fate.name, old_name, new_name);
  fate.name.insert(0, prefix_);
  fate.command = JudgeCommandChannel(fate.name);
  return fate;
}

}  // namespace axlecast
