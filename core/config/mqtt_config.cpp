#include "core/config/mqtt_config.h"

#include <algorithm>
#include <string_view>

#include "core/base/spelling.h"
#include "core/config/config_map.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestPrefix = 64;
constexpr std::size_t kLongestHost = 253;     // of a name in DNS
constexpr std::size_t kLongestClientId = 64;  // MQTT 3.1.1 asks brokers for 23 only; the usual ones take more
constexpr MonoNs kDay = 86'400 * kSecond;

bool IsPlain(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < '\x7F'; });
}

// Levels that hold something, without what MQTT reserves.
bool IsTopic(std::string_view text) {
  return !text.empty() && text.size() <= kLongestPrefix && IsPlain(text) && text.front() != '/' &&
         text.back() != '/' && text.front() != '$' && text.find("//") == std::string_view::npos &&
         text.find_first_of("+#") == std::string_view::npos;
}

constexpr double kMaxDeadband = 1e12;

std::string LoadFile(ConfigMap& map, const char* key) {
  std::string file = map.String(key, "");
  if (map.Has(key) && !file.starts_with('/')) {
    map.Error(key, Quoted(file) + " is no absolute path, e.g. /etc/axlecast/" + key + ".pem");
  }
  return file;
}

// Reads the place of the password. A password in the file itself is refused, and the error does not repeat it.
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

// Reads a pace; `pace` contains the defaults.
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

std::vector<MqttFault> FaultsOf(const MqttConfig& mqtt) {
  std::vector<MqttFault> faults;
  const auto require = [&faults](bool holds, const char* key, const char* text) {
    if (!holds) faults.push_back({key, text});
  };
  require(!mqtt.host.empty() && mqtt.host.size() <= kLongestHost && IsPlain(mqtt.host), "host",
          "is the broker's name or address: broker.example, 192.0.2.7");
  require(
      IsTopic(mqtt.prefix), "prefix",
      "is the beginning of topics: 1 to 64 characters without +, #, blanks and a leading $, / between levels only");
  require(mqtt.client_id.size() <= kLongestClientId && IsPlain(mqtt.client_id), "client_id",
          "has at most 64 characters without blanks");
  require(mqtt.password.empty() || !mqtt.user.empty(), "password", "needs user beside it");
  if (mqtt.tls) {
    require(mqtt.tls->certificate.empty() == mqtt.tls->key.empty(), "tls",
            "certificate and key belong together: give both or none");
  }
  require(mqtt.queue_messages >= kMinQueueMessages, "queue", "messages is at least 100");
  require(mqtt.queue_bytes >= kMinQueueBytes, "queue", "size is at least 256kB");
  return faults;
}

std::vector<MqttFault> FaultsOf(const PositionPace& pace) {
  std::vector<MqttFault> faults;
  if (pace.interval < 10 * kMillisecond || pace.interval > kDay) {
    faults.push_back({"interval", "is 0.01s to 1d: more is for LCM"});
  }
  if (pace.longest < pace.interval || pace.longest > kDay) {
    faults.push_back({"longest", "is from interval to 1d"});
  }
  return faults;
}

std::int64_t PortOf(const MqttConfig& mqtt) {
  if (mqtt.port != 0) return mqtt.port;
  return mqtt.tls ? 8883 : 1883;
}

const PositionPace& PaceOf(const MqttConfig& mqtt, const std::string& device) {
  const auto found = mqtt.devices.find(device);
  return found == mqtt.devices.end() ? mqtt.positions : found->second;
}

std::string BrokerText(const MqttConfig& mqtt) {
  const bool address = mqtt.host.find(':') != std::string::npos;
  return (address ? '[' + mqtt.host + ']' : mqtt.host) + ':' + std::to_string(PortOf(mqtt));
}

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
