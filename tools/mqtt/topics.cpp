#include "tools/mqtt/topics.h"

#include <algorithm>
#include <array>

#include "core/messages/json/message_json.h"
#include "core/messages/message.h"
#include "tools/mqtt/mqtt_status.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxRecorders = 32;  // their names are not in the machine's file
constexpr MonoNs kMinInterval = 100 * kMillisecond;
constexpr MonoNs kMaxInterval = 60 * kSecond;  // of a state without a change, because its counters change

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

using Json = nlohmann::ordered_json;

// Members that are not published: fields for LCM only, and secrets.
constexpr const char* kOmitted[] = {"spare", "sig", "token", "body_digest"};

// Returns the schema of the published messages of a type.
template <typename Message>
Json Published() {
  Json schema = Json::parse(FindMessageType(Encoded(Message{}))->schema);
  Json& required = schema["required"];
  for (const char* key : kOmitted) {
    schema["properties"].erase(key);
    required.erase(std::remove(required.begin(), required.end(), Json(key)), required.end());
  }
  schema["properties"]["publication"] = {{"type", "integer"}, {"minimum", 0}};
  required.push_back("publication");
  schema["additionalProperties"] = false;
  return schema;
}

// The last will contains only state and boot_id.
Json Status() {
  Json schema = {{"title", "status"}, {"type", "object"}, {"properties", Json::object()}};
  const Json status = MqttStatusJson("online", 0, 0, {});
  for (const auto& [key, value] : status.items()) {
    schema["properties"][key] = {{"type", value.is_string() ? "string" : "integer"}};
  }
  schema["properties"]["state"] = {{"enum", {"online", "offline", "ended"}}};
  schema["required"] = {"state", "boot_id"};
  schema["additionalProperties"] = false;
  return schema;
}

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
              (name.starts_with("recorder/") && IsRecorder(name.substr(std::string_view("recorder/").size())));
    }
    if (!known) return std::nullopt;
    MqttTopic topic{base_ + std::string(kind.level) + name, kind.type, kind.keeping, kind.retain, {}};
    topic.pace =
        kind.keeping == RetentionClass::kSamples ? device->second : PositionPace{kMinInterval, 0, kMaxInterval};
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
  // The rule of `axlecast record --name`.
  const bool good = !name.empty() && name.size() <= 24 &&
                    name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-") ==
                        std::string::npos;
  if (!good || recorders_.size() >= kMaxRecorders) return false;
  recorders_.insert(name);
  return true;
}

std::optional<Json> MqttPayload(std::string_view type, Bytes message) {
  std::string found;
  std::optional<Json> json = DecodeToJson(message, &found);
  if (!json || found != type) return std::nullopt;
  for (const char* key : kOmitted) json->erase(key);
  return json;
}

Json MqttSchemas() {
  return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
          {"$defs",
           {{"position", Published<position_t>()},
            {"motor", Published<motor_health_t>()},
            {"limits", Published<motor_limits_t>()},
            {"device", Published<device_info_t>()},
            {"bus", Published<bus_health_t>()},
            {"alarm", Published<alarm_t>()},
            {"recorder", Published<recorder_health_t>()},
            {"trip", Published<trip_log_t>()},
            {"command", Published<command_status_t>()},
            {"status", Status()}}}};
}

}  // namespace axlecast
