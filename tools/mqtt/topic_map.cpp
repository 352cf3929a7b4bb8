#include "tools/mqtt/topic_map.h"

#include <array>

#include "core/base/spelling.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxRecorders = 32;  // whose names are no part of the machine's file
constexpr MonoNs kAtOnce = 100 * kMillisecond;
constexpr MonoNs kAnyway = 60 * kSecond;  // a state that has not changed: its counters have

struct Kind {
  std::string_view channel;
  std::string_view level;
  std::string_view type;
  RetentionClass keeping;
  bool retain;
};

constexpr std::array<Kind, 8> kKinds = {{
    {"POSITION", "position/", "position_t", RetentionClass::kSamples, false},
    {"MOTOR", "motor/", "motor_health_t", RetentionClass::kSamples, false},
    {"LIMITS", "limits/", "motor_limits_t", RetentionClass::kNewest, true},
    {"DEVICE", "device/", "device_info_t", RetentionClass::kNewest, true},
    {"BUS", "bus/", "bus_health_t", RetentionClass::kNewest, true},
    {"ALARM", "alarm/", "alarm_t", RetentionClass::kNewest, true},
    {"RECORDER", "recorder/", "recorder_health_t", RetentionClass::kNewest, true},
    {"TRIP", "trip/", "trip_log_t", RetentionClass::kEvents, false},
}};

constexpr std::string_view kRecorderLevel = "recorder/";

}  // namespace

std::string MqttAlarmName(const MachineConfig& machine) { return "mqtt/" + machine.machine; }

std::string MqttDataChannels() {
  std::string kinds;
  for (const Kind& kind : kKinds) kinds += (kinds.empty() ? "" : "|") + std::string(kind.channel);
  return '(' + kinds + ")/.*";
}

TopicMap::TopicMap(const MachineConfig& machine)
    : base_(machine.mqtt.prefix + '/' + machine.machine + '/'),
      status_(base_ + "status"),
      own_(MqttAlarmName(machine)) {
  for (const BusConfig& bus : machine.buses) {
    buses_.insert(bus.name);
    for (const DeviceConfig& device : bus.devices) devices_[device.name] = PaceOf(machine.mqtt, device.name);
  }
}

std::optional<MqttTopic> TopicMap::Find(std::string_view channel) {
  const std::size_t slash = channel.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const std::string name(channel.substr(slash + 1));
  for (const Kind& kind : kKinds) {
    if (channel.substr(0, slash) != kind.channel) continue;
    const auto device = devices_.find(name);
    bool known = device != devices_.end();
    if (kind.channel == "BUS") known = buses_.contains(name);
    if (kind.channel == "RECORDER") known = IsRecorder(name);
    if (kind.channel == "ALARM" && !known) {
      known = name == "bridge" || name == own_ ||
              (name.starts_with(kRecorderLevel) && IsRecorder(name.substr(kRecorderLevel.size())));
    }
    if (!known) return std::nullopt;
    MqttTopic topic{base_ + std::string(kind.level) + name, kind.type, kind.keeping, kind.retain, {}};
    topic.pace = kind.keeping == RetentionClass::kSamples ? device->second : PositionPace{kAtOnce, 0, kAnyway};
    if (kind.keeping == RetentionClass::kEvents) topic.pace = {};
    return topic;
  }
  return std::nullopt;
}

std::optional<MqttTopic> TopicMap::CommandTopic(std::string_view device) const {
  if (!devices_.contains(device)) return std::nullopt;
  return MqttTopic{
      base_ + "command/" + std::string(device), "command_status_t", RetentionClass::kEvents, false, {}};
}

bool TopicMap::IsRecorder(const std::string& name) {
  if (recorders_.contains(name)) return true;
  // As `axlecast record --name` allows it.
  const bool good = !name.empty() && name.size() <= 24 &&
                    name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
                        std::string::npos;
  if (!good || recorders_.size() >= kMaxRecorders) return false;
  recorders_.insert(name);
  return true;
}

}  // namespace axlecast
