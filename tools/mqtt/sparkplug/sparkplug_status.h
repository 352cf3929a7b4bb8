#pragma once

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>

#include "tools/mqtt/mqtt_status.h"
#include "tools/mqtt/sparkplug/edge_session.h"
#include "tools/mqtt/sparkplug/sample_log.h"

namespace axlecast {

// The state of the connection from LCM to a broker for Sparkplug.
struct SparkplugStatus {
  MqttFeedCounts feed;
  BrokerStatus broker;
  EdgeCounts edge;
  SampleLogCounts log;
  bool born = false;
  bool waits_for_host = false;
  bool caught_up = false;
  std::int64_t unknown = 0;  // stored samples of devices that are not in the machine's file any more

  // Number of samples and damaged stretches that will never reach the broker.
  [[nodiscard]] std::int64_t Lost() const { return feed.lost + log.dropped + log.unstored + log.damaged + unknown; }
  // For the alarms of `axlecast mqtt`.
  [[nodiscard]] MqttStatus ForAlarms() const;
};

[[nodiscard]] nlohmann::ordered_json SparkplugStatusJson(const SparkplugStatus& status);
// Returns a line for the log: "born, 1234 samples live, 56 historical; 3 dropped, because the outbox was full".
[[nodiscard]] std::string SparkplugStatusLine(const SparkplugStatus& status);

}  // namespace axlecast
