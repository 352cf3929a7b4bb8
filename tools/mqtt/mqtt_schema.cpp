#include "tools/mqtt/mqtt_schema.h"

#include <algorithm>
#include <vector>

#include "core/messages/json/message_json.h"
#include "tools/mqtt/mqtt_payload.h"
#include "tools/mqtt/mqtt_status.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

template <typename Message>
std::vector<std::uint8_t> Encoded() {
  const Message message{};
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

Json SchemaOf(const Json& value) {
  if (value.is_string()) return {{"type", "string"}};
  return {{"type", "integer"}};
}

void Require(Json& schema, const std::string& key, const Json& of) {
  schema["properties"][key] = of;
  schema["required"].push_back(key);
}

void Drop(Json& schema, const std::string& key) {
  schema["properties"].erase(key);
  Json& required = schema["required"];
  required.erase(std::remove(required.begin(), required.end(), Json(key)), required.end());
}

// The type's own schema without what MqttPayload leaves out, and with the number of the publication.
template <typename Message>
Json Published() {
  const std::vector<std::uint8_t> bytes = Encoded<Message>();
  const MessageType& type = *FindMessageType(bytes);
  Json schema = Json::parse(type.schema);
  const Json payload = *MqttPayload(type.name, bytes);
  std::string name;
  const Json message = *DecodeToJson(bytes, &name);
  for (const auto& [key, value] : message.items()) {
    if (!payload.contains(key)) Drop(schema, key);
  }
  Require(schema, "publication", {{"type", "integer"}, {"minimum", 0}});
  schema["additionalProperties"] = false;
  return schema;
}

// The last will holds state and boot_id only.
Json Status() {
  Json schema = {{"title", "status"}, {"type", "object"}, {"properties", Json::object()}};
  const Json status = MqttStatusJson("online", 0, 0, {});
  for (const auto& [key, value] : status.items()) schema["properties"][key] = SchemaOf(value);
  schema["properties"]["state"] = {{"enum", {"online", "offline", "ended"}}};
  schema["required"] = {"state", "boot_id"};
  schema["additionalProperties"] = false;
  return schema;
}

}  // namespace

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
