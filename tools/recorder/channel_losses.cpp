#include "tools/recorder/channel_losses.h"

#include <algorithm>
#include <array>
#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/exchange_times_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <axlecast/trip_log_t.hpp>
#include <axlecast/wire_t.hpp>
#include <optional>

#include "core/messages/json/field.h"

namespace axlecast {
namespace {

// Returns true for the types whose .lcm defines consecutive numbers.
bool IsNumbered(std::int64_t hash) {
  static const std::array<std::int64_t, 13> kNumbered = {
      alarm_t::getHash(),          bus_health_t::getHash(),    device_info_t::getHash(),
      motor_health_t::getHash(),   position_t::getHash(),      position_block_t::getHash(),
      trip_log_t::getHash(),       wire_t::getHash(),          recorder_health_t::getHash(),
      command_status_t::getHash(), driver_status_t::getHash(), exchange_times_t::getHash(),
      motor_limits_t::getHash(),
  };
  return std::find(kNumbered.begin(), kNumbered.end(), hash) != kNumbered.end();
}

}  // namespace

void ChannelLosses::On(const LoggedMessage& message) {
  const std::optional<std::int64_t> hash = Fingerprint(message.data);
  if (!hash || !IsNumbered(*hash)) return;
  const std::optional<MessageHead> head = ReadHead(message.data);
  if (!head) return;
  auto channel = channels_.find(message.channel);
  if (channel == channels_.end()) {
    if (channels_.size() >= kMaxChannels) return;
    channel = channels_.emplace(message.channel, SequenceCount()).first;
  }
  channel->second.On(head->boot_id, head->seq);
}

std::vector<ChannelLoss> ChannelLosses::losses() const {
  std::vector<ChannelLoss> losses;
  for (const auto& [channel, count] : channels_) {
    if (count.lost() > 0) losses.push_back({channel, count.received(), count.lost()});
  }
  std::stable_sort(losses.begin(), losses.end(),
                   [](const ChannelLoss& one, const ChannelLoss& other) { return one.lost > other.lost; });
  return losses;
}

}  // namespace axlecast
