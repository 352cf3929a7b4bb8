#pragma once

#include <axlecast/alarm_t.hpp>
#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>

#include "core/alarm/alarm_table.h"
#include "core/base/time.h"
#include "tools/mqtt/broker_session.h"
#include "tools/mqtt/mqtt_feed.h"
#include "tools/mqtt/outbox.h"

namespace axlecast {

// How the bridge to a broker stands.
struct MqttStatus {
  MqttFeedCounts feed;
  OutboxCounts outbox;
  BrokerStatus broker;

  // Messages that should be with the broker and never will, as far as it is known.
  [[nodiscard]] std::int64_t Lost() const { return feed.lost + feed.too_long + outbox.Lost(); }
};

// What is published on the topic `status`. `state`: "online", "offline" (the last will) or "ended".
[[nodiscard]] nlohmann::ordered_json MqttStatusJson(const char* state, std::int64_t boot_id);
[[nodiscard]] nlohmann::ordered_json MqttStatusJson(const char* state, std::int64_t boot_id, std::int64_t utime,
                                                    const MqttStatus& status);

// For people: "connected, 1234 messages published; 17 wait; lost: 3 samples".
[[nodiscard]] std::string MqttStatusLine(const MqttStatus& status);

// Alarms of the bridge to a broker: docs/alarms.md. Codes never change.
namespace mqtt_alarms {

inline constexpr std::uint8_t kMqtt = alarm_entry_t::SOURCE_MQTT;

inline constexpr AlarmSpec kBrokerAway = {500, kMqtt, alarm_entry_t::SEVERITY_WARNING, "broker_away",
                                          "No connection to the MQTT broker: axlecast mqtt says why on its log."};
inline constexpr AlarmSpec kMessagesShed = {
    501, kMqtt, alarm_entry_t::SEVERITY_WARNING, "mqtt_messages_shed",
    "What waits for the broker exceeds mqtt.queue: the oldest positions are shed."};
inline constexpr AlarmSpec kMessagesRefused = {502, kMqtt, alarm_entry_t::SEVERITY_WARNING, "mqtt_refused",
                                               "The broker refuses messages: check its access list and limits."};

}  // namespace mqtt_alarms

// What the bridge to a broker publishes on ALARM/mqtt/<machine>.
class MqttAlarms {
 public:
  static constexpr MonoNs kAway = 10 * kSecond;  // a broker's restart is no alarm

  // `name`: MqttAlarmName; `start`: since when the broker could be there.
  MqttAlarms(std::string name, std::int64_t boot_id, MonoNs start);

  // `utime`: us, UNIX time of `now`. The message is valid until the next call.
  [[nodiscard]] const alarm_t& Make(const MqttStatus& status, MonoNs now, std::int64_t utime);

 private:
  AlarmTable book_;
  alarm_t message_{};
  MonoNs start_;
  std::int64_t shed_before_ = 0;
  std::int64_t refused_before_ = 0;
};

}  // namespace axlecast
