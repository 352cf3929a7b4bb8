#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/messages/broker_link.h"
#include "tools/mqtt/sparkplug/message_metrics.h"
#include "tools/mqtt/sparkplug/metric_table.h"
#include "tools/mqtt/sparkplug/sample_log.h"
#include "tools/mqtt/sparkplug/sparkplug_topics.h"

namespace axlecast {

// A machine as an edge node of Sparkplug: its metrics and those of its devices, which devices are born, and the messages that follow.
// Does no I/O. The caller sends every returned message, in order, because each has its sequence number.
class EdgeNode {
 public:
  static constexpr MonoNs kSilent = 5 * kSecond;   // DEVICE is published once a second
  static constexpr std::size_t kMaxMetrics = 200;  // of one message of historical values

  // `version`: of axlecast, a metric of the node. Every device counts as alive until it is reported OFFLINE, or sends nothing
  // within kSilent after `start`.
  EdgeNode(const MachineConfig& machine, SparkplugTopics topics, std::string_view version, MonoNs start);

  // Begins a session with the number of its connection.
  void BeginSession(std::uint8_t birth_sequence);
  // Returns the NDEATH of the session: the last will, and the message before an orderly end.
  [[nodiscard]] BrokerMessage Death(std::int64_t now_ms) const;
  // Returns NBIRTH and a DBIRTH of each device that is alive; `all`: of every device. The sequence numbers begin at 0.
  [[nodiscard]] std::vector<BrokerMessage> Births(bool all, Timestamp now);

  // Returns true if the channel has metrics of this node: of its devices and buses, not of other programs.
  [[nodiscard]] bool Publishes(std::string_view channel) const;
  // A message of the channel was received, whether it is published or not.
  void OnHeard(std::string_view channel, MonoNs now);
  // Takes a sample as the current values. `live`: returns the messages that publish it. A device that is not born gets its
  // DBIRTH when it is ONLINE or DEGRADED; until then, its samples only change the values of that birth.
  [[nodiscard]] std::vector<BrokerMessage> OnSample(std::string_view channel, Bytes message, bool live,
                                                    Timestamp now);
  // Returns the DDEATHs of devices that are OFFLINE or silent.
  [[nodiscard]] std::vector<BrokerMessage> Deaths(Timestamp now);
  // Returns samples as historical values of born devices.
  [[nodiscard]] std::vector<BrokerMessage> Historical(const std::vector<StoredSample>& samples, Timestamp now);

  [[nodiscard]] const SparkplugTopics& topics() const { return topics_; }
  // Samples of devices that are not in the machine's file any more.
  [[nodiscard]] std::int64_t unknown() const { return unknown_; }

 private:
  struct Device {
    MetricTable table;
    MonoNs heard_at = 0;
    bool online = true;  // by its state
    bool born = false;
  };

  [[nodiscard]] static bool IsAlive(const Device& device, MonoNs now);
  [[nodiscard]] MetricTable* TableOf(const std::string& device);
  [[nodiscard]] BrokerMessage Message(const std::string& topic, std::vector<SparkplugMetric> metrics,
                                      std::int64_t now_ms);
  [[nodiscard]] BrokerMessage BirthOf(const std::string& name, Device& device, std::int64_t now_ms);
  [[nodiscard]] std::string DataTopic(const std::string& device) const;

  SparkplugTopics topics_;
  std::uint64_t next_alias_ = 1;
  MetricTable node_;
  std::map<std::string, Device, std::less<>> devices_;
  std::set<std::string, std::less<>> buses_;
  std::uint8_t birth_sequence_ = 0;
  std::uint8_t seq_ = 0;  // of the next message
  std::int64_t unknown_ = 0;
};

// The metric of an NCMD that requests a new birth.
inline constexpr std::string_view kRebirthMetric = "Node Control/Rebirth";

}  // namespace axlecast
