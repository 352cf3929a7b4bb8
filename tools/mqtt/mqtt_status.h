#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

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

}  // namespace axlecast
