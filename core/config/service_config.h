#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/secret.h"
#include "core/base/time.h"

namespace axlecast {

class ConfigMap;

// A value that cannot be used, from the machine's file or from the command line.
struct ConfigFault {
  const char* key;   // of docs/configuration.md
  std::string text;  // what would be right
};

// One log of a recorder: what goes into it, how it is cut, how long it stays.
struct LogConfig {
  std::string name;
  std::string channels;          // regular expression; empty: all
  bool invert = false;           // channels that do not match
  std::int64_t split_bytes = 0;  // 0: derived from quota and keep
  MonoNs split_time = 0;         // 0: derived from keep
  std::int64_t quota_bytes = 0;  // 0: no limit
  MonoNs keep = 0;               // 0: no limit
  bool compress = false;         // closed logs become NAME.lcm.zst
  MonoNs sync = 100 * kMillisecond;
  std::int64_t buffer_bytes = 64 << 20;  // of messages that wait for the disk
  std::string trigger;                   // regular expression; empty: records always
  MonoNs pre_trigger = 0;
  MonoNs post_trigger = 10 * kSecond;
};

struct RecorderConfig {
  std::string directory;  // empty: see LogDirectory
  std::vector<LogConfig> logs;
};

[[nodiscard]] std::vector<ConfigFault> FaultsOf(const LogConfig& log);

// Return the size and the time after which a log ends (0: no limit). Both are also derived from `quota` and `keep`, because
// the log that is being written is never deleted.
[[nodiscard]] std::int64_t SplitBytes(const LogConfig& log);
[[nodiscard]] MonoNs SplitTime(const LogConfig& log);

// Reads `recorder`: the logs that are written of the machine.
[[nodiscard]] RecorderConfig LoadRecorder(ConfigMap map);

// Where and to whom `axlecast web` serves its page.
struct WebConfig {
  std::string bind = "127.0.0.1";  // an address of this host, or a wildcard
  int port = 8380;
  std::string certificate = {};         // PEM file with its chain; empty: no TLS
  std::string key = {};                 // PEM file
  SecretPlace token = {};               // empty: everyone who can reach the address may view the page
  std::vector<std::string> names = {};  // under which browsers reach this host, besides its own
  std::string fleet_database = {};      // libpq's connection string, without a password; empty: no fleet is shown
  SecretPlace fleet_password = {};
};

// Returns true for an IPv4 address with four numbers, and for an IPv6 address without brackets.
[[nodiscard]] bool IsIpAddress(const std::string& text);

// Whether only this host reaches the address.
[[nodiscard]] bool IsLoopback(const std::string& address);

// What a browser opens. `host`: this host's name, for a wildcard.
[[nodiscard]] std::string WebUrl(const WebConfig& web, const std::string& host);

[[nodiscard]] std::vector<ConfigFault> FaultsOf(const WebConfig& web);

// The `web` block.
[[nodiscard]] WebConfig LoadWeb(ConfigMap map);

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

// Publishing as an edge node of Sparkplug B: docs/sparkplug.md.
struct SparkplugConfig {
  std::string group;
  std::string node;                       // empty: the machine's name
  std::string primary_host;               // empty: the node waits for no host
  std::string directory;                  // of the samples that wait; empty: sparkplug in StateDirectory
  std::int64_t outbox_bytes = 256 << 20;  // of these samples at most
  MonoNs sync = kSecond;                  // a power failure loses at most the samples of this time
  MonoNs repeat = 10 * kSecond;           // the last samples of a session that the next one sends again
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
  std::optional<SparkplugConfig> sparkplug;  // in the place of the topics of docs/mqtt.md
};

inline constexpr std::int64_t kMinQueueMessages = 100;
inline constexpr std::int64_t kMinQueueBytes = 256 << 10;
inline constexpr std::int64_t kMinOutboxBytes = 1 << 20;

[[nodiscard]] std::vector<ConfigFault> FaultsOf(const MqttConfig& mqtt);
[[nodiscard]] std::vector<ConfigFault> FaultsOf(const PositionPace& pace);

[[nodiscard]] std::int64_t PortOf(const MqttConfig& mqtt);
[[nodiscard]] const PositionPace& PaceOf(const MqttConfig& mqtt, const std::string& device);
// "broker.example:8883", an IPv6 address in brackets.
[[nodiscard]] std::string BrokerText(const MqttConfig& mqtt);

// Reads `mqtt`: the broker that the machine's messages go to. `devices`: those of the machine.
[[nodiscard]] MqttConfig LoadMqtt(ConfigMap map, const std::vector<std::string>& devices);

// The time base of a machine on several hosts: docs/time.md.
struct TimeConfig {
  std::string root;        // the host whose clock is the base; empty: the machine has no time base
  std::string address;     // IP address of the root
  int port = 7670;         // UDP
  int max_rate_ppm = 100;  // greatest difference of the rates of two hosts' CLOCK_MONOTONIC_RAW
  int max_slew_ppm =
      1'000;             // greatest difference of the rates of CLOCK_MONOTONIC and CLOCK_MONOTONIC_RAW of a host
  int ptp_bound_us = 0;  // greatest error of UNIX time that the operator grants PTP; 0: none is assumed
};

[[nodiscard]] std::vector<ConfigFault> FaultsOf(const TimeConfig& time);

// Reads `time`.
[[nodiscard]] TimeConfig LoadTime(ConfigMap map);

// Returns true if the text can be a host's name in `time: root:` and in the channel TIME/<host>.
[[nodiscard]] bool IsHostName(std::string_view text);

}  // namespace axlecast
