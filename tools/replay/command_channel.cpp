#include "tools/replay/command_channel.h"

#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/permit_t.hpp>
#include <cstdint>

namespace axlecast {
namespace {

constexpr std::array<std::string_view, 2> kWhole = {"COMMAND", "COMMAND_STATUS"};
constexpr std::array<std::string_view, 3> kFamilies = {"PERMIT/", "DRIVER_COMMAND/", "DRIVER_STATUS/"};

CommandChannel JudgeAt(std::size_t place) {
  if (place == std::string_view::npos) return CommandChannel::kNone;
  return place == 0 ? CommandChannel::kPlain : CommandChannel::kBehindPrefix;
}

}  // namespace

CommandChannel JudgeCommandChannel(std::string_view channel) {
  CommandChannel judged = CommandChannel::kNone;
  for (const std::string_view name : kWhole) {
    if (channel.ends_with(name)) judged = std::max(judged, JudgeAt(channel.size() - name.size()));
  }
  for (const std::string_view name : kFamilies) judged = std::max(judged, JudgeAt(channel.find(name)));
  return judged;
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

}  // namespace axlecast
