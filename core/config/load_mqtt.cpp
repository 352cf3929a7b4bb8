#include "core/config/load_mqtt.h"

#include <algorithm>

#include "core/base/words.h"
#include "core/config/load_place.h"

namespace axlecast {
namespace {

constexpr double kMaxDeadband = 1e12;

std::string LoadFile(ConfigMap& map, const char* key) {
  std::string file = map.String(key, "");
  if (map.Has(key) && !file.starts_with('/')) {
    map.Error(key, Quoted(file) + " is no absolute path, e.g. /etc/axlecast/" + key + ".pem");
  }
  return file;
}

// The place of the password. One that stands in the file itself is refused, and not repeated.
SecretPlace LoadPassword(ConfigMap& map) {
  constexpr const char* kRule = "names no place: {file: /etc/axlecast/mqtt.password} or {credential: NAME}";
  if (!map.node()["password"].IsMap()) {
    map.Error("password", kRule);
    return {};
  }
  ConfigMap keys = map.Map("password");
  SecretPlace place = LoadPlace(keys, "/etc/axlecast/mqtt.password");
  if (place.empty()) map.Error("password", kRule);
  keys.Done();
  return place;
}

// What stands in `pace` is the default.
PositionPace LoadPace(ConfigMap& map, PositionPace pace) {
  pace.interval = map.Time("interval", pace.interval);
  pace.deadband = map.Number("deadband", pace.deadband, 0, kMaxDeadband, "(in the device's unit)");
  pace.longest = map.Time("longest", pace.longest);
  if (!map.Has("longest")) pace.longest = std::max(pace.longest, pace.interval);
  for (const MqttFault& fault : FaultsOf(pace)) map.Error(fault.key, fault.text);
  return pace;
}

void LoadPositions(ConfigMap map, const std::vector<std::string>& devices, MqttConfig& mqtt) {
  mqtt.positions = LoadPace(map, mqtt.positions);
  for (auto& [name, keys] : map.Maps("devices")) {
    if (std::find(devices.begin(), devices.end(), name) == devices.end()) {
      const auto near = NearestWord(name, devices);
      map.Error("devices",
                "there is no device " + Quoted(name) +
                    (near ? "; did you mean " + Quoted(*near) + "?" : "; known here: " + Listed(devices)));
    }
    mqtt.devices[name] = LoadPace(keys, mqtt.positions);
    keys.Done();
  }
  map.Done();
}

void LoadTls(ConfigMap map, MqttConfig& mqtt) {
  MqttTls& tls = mqtt.tls.emplace();
  tls.ca = LoadFile(map, "ca");
  tls.certificate = LoadFile(map, "certificate");
  tls.key = LoadFile(map, "key");
  map.Done();
}

void LoadQueue(ConfigMap map, MqttConfig& mqtt) {
  mqtt.queue_messages = map.Integer("messages", mqtt.queue_messages, kMinQueueMessages, 10'000'000, "messages");
  mqtt.queue_bytes = map.Size("size", mqtt.queue_bytes);
  map.Done();
}

}  // namespace

MqttConfig LoadMqtt(ConfigMap map, const std::vector<std::string>& devices) {
  MqttConfig mqtt;
  const bool stands = map.node().IsDefined() && (map.node().IsMap() || map.node().IsNull());
  map.MarkRequired("host");
  mqtt.host = map.String("host", "");
  mqtt.port = map.Integer("port", 0, 1, 65'535, "(1883, with tls 8883)");
  mqtt.version_5 = map.Choice("protocol", {"5", "3.1.1"}, 0) == 0;
  mqtt.prefix = map.String("prefix", mqtt.prefix);
  mqtt.client_id = map.String("client_id", "");
  mqtt.user = map.String("user", "");
  if (map.Has("password")) mqtt.password = LoadPassword(map);
  if (map.Has("tls")) LoadTls(map.Map("tls"), mqtt);
  LoadPositions(map.Map("positions"), devices, mqtt);
  LoadQueue(map.Map("queue"), mqtt);
  if (stands) {
    for (const MqttFault& fault : FaultsOf(mqtt)) map.Error(fault.key, fault.text);
  }
  map.Done();
  return mqtt;
}

}  // namespace axlecast
