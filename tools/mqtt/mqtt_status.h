#pragma once

#include <axlecast/alarm_t.hpp>
#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>
#include <utility>

#include "core/alarm/alarm_table.h"
#include "core/base/time.h"
#include "core/messages/origin.h"
#include "tools/mqtt/broker_session.h"
#include "tools/mqtt/mqtt_feed.h"
#include "tools/mqtt/outbox.h"

namespace axlecast {

// The state of the connection from LCM to the broker.
struct MqttStatus {
  MqttFeedCounts feed;
  OutboxCounts outbox;
  BrokerStatus broker;

  // Number of messages that will never reach the broker.
  [[nodiscard]] std::int64_t Lost() const { return feed.lost + feed.too_long + outbox.Lost(); }
};

// Returns the message on the topic `status`. `state` is "online", "offline" (the last will) or "ended".
[[nodiscard]] nlohmann::ordered_json MqttStatusJson(const char* state, std::int64_t boot_id);
[[nodiscard]] nlohmann::ordered_json MqttStatusJson(const char* state, std::int64_t boot_id, std::int64_t utime,
                                                    const MqttStatus& status);

// Returns a line for the log: "connected, 1234 messages delivered, 17 wait; 3 samples shed".
[[nodiscard]] std::string MqttStatusLine(const MqttStatus& status);

// Makes the messages on ALARM/mqtt/<machine>.
class MqttAlarms {
 public:
  static constexpr MonoNs kAway = 10 * kSecond;  // a restart of the broker raises no alarm

  // `name`: MqttAlarmName; `start`: since when the broker could be there.
  MqttAlarms(std::string name, const Origin& origin, MonoNs start)
      : alarms_(std::move(name), origin), start_(start) {}

  // `utime`: us, UNIX time of `now`. The message is valid until the next call.
  [[nodiscard]] const alarm_t& Make(const MqttStatus& status, MonoNs now, std::int64_t utime);

 private:
  ProgramAlarms alarms_;
  MonoNs start_;
  std::int64_t shed_before_ = 0;
  std::int64_t refused_before_ = 0;
};

}  // namespace axlecast
