#include "tools/mqtt/mqtt_payload.h"

#include "core/messages/json/message_json.h"

namespace axlecast {

using Json = nlohmann::ordered_json;

std::optional<Json> MqttPayload(std::string_view type, Bytes message) {
  std::string found;
  std::optional<Json> json = DecodeToJson(message, &found);
  if (!json || found != type) return std::nullopt;
  for (const char* key : {"spare", "sig", "token", "body_digest"}) json->erase(key);
  return json;
}

}  // namespace axlecast
