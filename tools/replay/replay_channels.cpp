#include "tools/replay/replay_channels.h"

#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/permit_t.hpp>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/expression.h"
#include "core/base/result.h"
#include "tools/log/log_event.h"

namespace axlecast {
namespace {

constexpr std::array<std::string_view, 2> kWhole = {"COMMAND", "COMMAND_STATUS"};
constexpr std::array<std::string_view, 3> kFamilies = {"PERMIT/", "DRIVER_COMMAND/", "DRIVER_STATUS/"};

CommandChannel ChannelAt(std::size_t place) {
  if (place == std::string_view::npos) return CommandChannel::kNone;
  return place == 0 ? CommandChannel::kPlain : CommandChannel::kAfterPrefix;
}

}  // namespace

CommandChannel CommandChannelOf(std::string_view channel) {
  CommandChannel result = CommandChannel::kNone;
  for (const std::string_view name : kWhole) {
    if (channel.ends_with(name)) result = std::max(result, ChannelAt(channel.size() - name.size()));
  }
  for (const std::string_view name : kFamilies) result = std::max(result, ChannelAt(channel.find(name)));
  return result;
}

bool IsCommandMessage(Bytes message) {
  static const std::array<std::int64_t, 5> kTypes = {command_t::getHash(), command_status_t::getHash(),
                                                     permit_t::getHash(), driver_command_t::getHash(),
                                                     driver_status_t::getHash()};
  if (message.size() < 8) return false;
  std::uint64_t type = 0;
  for (const std::uint8_t byte : message.first(8)) type = type << 8 | byte;
  return std::find(kTypes.begin(), kTypes.end(), static_cast<std::int64_t>(type)) != kTypes.end();
}

Result<> ReplayChannels::Rename(const std::string& rule) {
  const std::size_t divide = rule.find('=');
  if (divide == std::string::npos || divide == 0) {
    return Failure("'" + rule + "' is not OLD=NEW, e.g. '^POSITION/=RECORDED/POSITION/'");
  }
  Result<std::regex> compiled = CompileExpression(rule.substr(0, divide));
  if (!compiled) return Failure(compiled.error());
  renames_.emplace_back(std::move(*compiled), rule.substr(divide + 1));
  return {};
}

const ReplayChannels::Target& ReplayChannels::Of(std::string_view channel) {
  if (const auto known = targets_.find(channel); known != targets_.end()) return known->second;
  const std::string name(channel);
  Target target;
  try {
    target = MakeTarget(name);
  } catch (const std::regex_error&) {
    // The expression is too complex for this name: the channel is not selected.
  }
  return targets_.emplace(name, std::move(target)).first->second;
}

ReplayChannels::Target ReplayChannels::MakeTarget(const std::string& channel) {
  if (IsLogChannel(channel) || !filter_.Matches(channel)) return {};
  Target target{.selected = true, .name = channel, .command = CommandChannel::kNone};
  for (const auto& [old_name, new_name] : renames_)
    target.name = std::regex_replace(target.name, old_name, new_name);
  target.name.insert(0, prefix_);
  target.command = CommandChannelOf(target.name);
  return target;
}

}  // namespace axlecast
