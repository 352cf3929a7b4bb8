#include "core/config/mqtt_config.h"

#include <algorithm>
#include <string_view>

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

}  // namespace axlecast
