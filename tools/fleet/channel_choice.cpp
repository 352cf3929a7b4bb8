#include "tools/fleet/channel_choice.h"

#include <algorithm>
#include <array>
#include <utility>

namespace axlecast {
namespace {

struct KindName {
  std::string_view begin;  // of the channel's name; without a slash: the whole name
  ChannelKind kind;
};
constexpr std::array<KindName, 11> kKinds{{{"POSITION/", ChannelKind::kPosition},
                                           {"POSITION_BLOCK/", ChannelKind::kPositionBlock},
                                           {"ALARM/", ChannelKind::kAlarm},
                                           {"TRIP/", ChannelKind::kTrip},
                                           {"DEVICE/", ChannelKind::kDevice},
                                           {"BUS/", ChannelKind::kBus},
                                           {"RECORDER/", ChannelKind::kRecorder},
                                           {"MOTOR/", ChannelKind::kMotor},
                                           {"TIME/", ChannelKind::kTime},
                                           {"COMMAND_STATUS", ChannelKind::kCommandStatus},
                                           {"COMMAND", ChannelKind::kCommand}}};

// Returns the kind of a channel and the rest of its name.
std::pair<ChannelKind, std::string_view> KindOf(std::string_view channel) {
  for (const KindName& known : kKinds) {
    const bool is_whole = known.begin.back() != '/';
    if (is_whole ? channel == known.begin : channel.starts_with(known.begin)) {
      return {known.kind, channel.substr(known.begin.size())};
    }
  }
  return {ChannelKind::kOther, {}};
}

}  // namespace

LogFacts LogFactsOf(const MachineConfig& machine) {
  LogFacts facts{
      .machine = machine.machine, .prefix = machine.lcm.prefix, .devices = {}, .logs = machine.recorder.logs};
  for (const BusConfig& bus : machine.buses) {
    if (!bus.family->has_position) continue;
    for (const DeviceConfig& device : bus.devices) {
      facts.devices[device.name] = {.counts_per_turn = device.settings->counts_per_turn,
                                    .unit = device.unit,
                                    .unit_per_count = UnitPerCount(device),
                                    .block = device.block};
    }
  }
  return facts;
}

ChannelChooser::ChannelChooser(const LogFacts& facts, std::string log, DetailRules detail)
    : prefix_(facts.prefix), log_(std::move(log)), detail_(std::move(detail)) {
  for (const auto& [name, device] : facts.devices) has_block_[name] = device.block;
  for (const LogConfig& config : facts.logs) {
    LogFilter filter{.name = config.name, .channels = {}};
    // The machine's file was checked when it was read. A filter that is invalid all the same selects nothing.
    if (config.trigger.empty() && filter.channels.Set(config.channels, config.invert)) {
      filters_.push_back(std::move(filter));
    }
  }
}

// Returns the name of the log that a channel belongs to, or null. Recorders match the whole name, with the prefix.
const std::string* ChannelChooser::LogOf(std::string_view channel) {
  const auto found = std::find_if(filters_.begin(), filters_.end(),
                                  [&](LogFilter& filter) { return filter.channels.Matches(channel); });
  return found == filters_.end() ? nullptr : &found->name;
}

ChannelDetail ChannelChooser::DetailOf(std::string_view channel) {
  if (const auto rule = detail_.Match(channel)) return *rule;
  if (KindOf(channel).first != ChannelKind::kOther) return {};
  return {.detail = Detail::kNone};
}

// Returns the detail of a channel if any log contributes it.
Detail ChannelChooser::ShippedDetail(const std::string& channel) {
  return LogOf(prefix_ + channel) != nullptr ? DetailOf(channel).detail : Detail::kNone;
}

bool ChannelChooser::IsSource(ChannelKind kind, const std::string& device) {
  const auto found = has_block_.find(device);
  if (found == has_block_.end() || !found->second) return kind == ChannelKind::kPosition;
  const bool takes_block = ShippedDetail("POSITION_BLOCK/" + device) >= ShippedDetail("POSITION/" + device);
  return takes_block == (kind == ChannelKind::kPositionBlock);
}

ChannelChoice ChannelChooser::Of(std::string_view channel) {
  const std::string* log = LogOf(channel);
  if (!channel.starts_with(prefix_) || log == nullptr || *log != log_) return {};
  channel.remove_prefix(prefix_.size());
  const auto [kind, rest] = KindOf(channel);
  ChannelChoice choice{.kind = kind, .name = std::string(rest), .detail = DetailOf(channel)};
  const bool is_position = kind == ChannelKind::kPosition || kind == ChannelKind::kPositionBlock;
  if (kind == ChannelKind::kOther || (is_position && !IsSource(kind, choice.name)))
    choice.detail.detail = Detail::kNone;
  return choice;
}

}  // namespace axlecast
