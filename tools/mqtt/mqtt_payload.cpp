#include "tools/mqtt/mqtt_payload.h"

#include <sstream>

#include "drivers/runtime/command/command_words.h"
#include "tools/json/field.h"
#include "tools/json/message_json.h"
#include "tools/json/names.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

std::int8_t Small(const Json& json, const char* key) { return json.at(key).get<std::int8_t>(); }

Json Words(const std::string& text) {
  Json words = Json::array();
  std::istringstream stream(text);
  for (std::string word; std::getline(stream, word, ',');) words.push_back(word);
  return words;
}

void AddWords(std::string_view type, Json& json) {
  if (type == "position_t") {
    json["unit_name"] = UnitName(Small(json, "unit"));
    json["flag_names"] = Words(FlagNames(json.at("flags").get<std::int32_t>()));
  } else if (type == "device_info_t") {
    json["state_name"] = DeviceStateName(Small(json, "state"));
    json["unit_name"] = UnitName(Small(json, "unit"));
  } else if (type == "bus_health_t") {
    json["state_name"] = BusStateName(Small(json, "state"));
  } else if (type == "command_status_t") {
    json["state_name"] = StateName(Small(json, "state"));
    json["reason_name"] = ReasonName(json.at("reason_code").get<std::int32_t>());
  } else if (type == "alarm_t") {
    for (Json& entry : json["entries"]) {
      entry["severity_name"] = SeverityName(Small(entry, "severity"));
      entry["state_name"] = AlarmStateName(Small(entry, "state"));
    }
  }
}

}  // namespace

std::optional<Json> MqttPayload(std::string_view type, Bytes message) {
  std::string found;
  std::optional<Json> json = DecodeToJson(message, &found);
  if (!json || found != type) return std::nullopt;
  for (const char* key : {"spare", "sig", "token", "body_digest"}) json->erase(key);
  AddWords(type, *json);
  return json;
}

}  // namespace axlecast
