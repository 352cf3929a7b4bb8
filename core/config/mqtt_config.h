#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/secret.h"
#include "core/base/time.h"

namespace axlecast {

class ConfigMap;

// How often one device's positions go to the broker.
struct PositionPace {
  MonoNs interval = kSecond;      // minimum time between two messages
  double deadband = 0;            // in the device's unit: a value that has not moved further is not sent again ...
  MonoNs longest = 10 * kSecond;  // ... before this time
};

// Files of OpenSSL, in PEM.
struct MqttTls {
  std::string ca;           // certificates that the broker's is checked against; empty: the system's
  std::string certificate;  // of this client; empty: none
  std::string key;          // of that certificate
};

// Where a machine's messages go by MQTT.
struct MqttConfig {
  std::string host;       // empty: nowhere
  std::int64_t port = 0;  // 0: 1883, with TLS 8883
  bool version_5 = true;  // else 3.1.1
  std::string prefix = "axlecast";
  std::string client_id;  // empty: axlecast-<machine>
  std::string user;       // empty: none
  SecretPlace password;
  std::optional<MqttTls> tls;
  PositionPace positions;
  std::map<std::string, PositionPace> devices;  // that have one of their own
  std::int64_t queue_messages = 10'000;         // wait for the broker at most
  std::int64_t queue_bytes = 16 << 20;
};

inline constexpr std::int64_t kMinQueueMessages = 100;
inline constexpr std::int64_t kMinQueueBytes = 256 << 10;

// What is wrong, and what would be right.
struct MqttFault {
  const char* key;  // of docs/configuration.md
  std::string text;
};
[[nodiscard]] std::vector<MqttFault> FaultsOf(const MqttConfig& mqtt);
[[nodiscard]] std::vector<MqttFault> FaultsOf(const PositionPace& pace);

[[nodiscard]] std::int64_t PortOf(const MqttConfig& mqtt);
[[nodiscard]] const PositionPace& PaceOf(const MqttConfig& mqtt, const std::string& device);
// "broker.example:8883", an IPv6 address in brackets.
[[nodiscard]] std::string BrokerText(const MqttConfig& mqtt);

// Reads `mqtt`: the broker that the machine's messages go to. `devices`: those of the machine.
[[nodiscard]] MqttConfig LoadMqtt(ConfigMap map, const std::vector<std::string>& devices);

}  // namespace axlecast
