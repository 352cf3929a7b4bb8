#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/config/machine_config.h"
#include "core/messages/broker_link.h"
#include "core/messages/sequence_count.h"
#include "tools/mqtt/outbox.h"
#include "tools/mqtt/topics.h"

namespace axlecast {

// The part of a message whose change triggers a new publication. Counters and timestamps are excluded.
struct ChangeKey {
  std::string mark;
  double value = 0;  // of a position, in its unit
};

// Returns nothing if the message has another type.
[[nodiscard]] std::optional<ChangeKey> ChangeKeyOf(std::string_view type, Bytes message);

// Returns true if the keys differ. Values that differ by at most `deadband` count as equal.
[[nodiscard]] bool Differ(const ChangeKey& newer, const ChangeKey& older, double deadband);

struct MqttFeedCounts {
  std::int64_t received = 0;   // messages of the machine
  std::int64_t lost = 0;       // messages lost on LCM, by sequence numbers
  std::int64_t foreign = 0;    // unknown names, malformed, or not signed by the machine's bridge
  std::int64_t too_long = 0;   // as JSON
  std::int64_t published = 0;  // given to `publish`
};

// Reduces the rate of the machine's LCM messages and publishes them as JSON. Does no I/O; time is an argument. counts() is
// thread-safe; all other functions must be called by one thread.
class MqttFeed {
 public:
  using Sink = std::function<void(BrokerMessage message, RetentionClass keeping)>;

  // Receives the selected messages as they are. `channel`: without the LCM prefix; of outcomes "COMMAND_STATUS/<device>".
  using MessageSink = std::function<void(std::string_view channel, Bytes message)>;

  MqttFeed(const MachineConfig& machine, Sink publish);
  MqttFeed(const MachineConfig& machine, MessageSink select);

  void OnData(const std::string& channel, Bytes message, MonoNs now);
  void OnCommandStatus(Bytes message, MonoNs now);
  // Publishes held messages that are due. Call it at least ten times per second.
  void Poll(MonoNs now);
  // Publishes all held messages that have changed.
  void Flush();
  // Publishes the next message of each state. Call it after a reconnection: the broker may have lost retained messages.
  void RepublishStates();

  [[nodiscard]] const TopicMap& topics() const { return topics_; }
  [[nodiscard]] MqttFeedCounts counts() const;

 private:
  struct Stream {
    MqttTopic topic;
    std::string channel;
    SequenceCount sequence;
    std::vector<std::uint8_t> held;  // the newest unpublished message; empty: none
    ChangeKey held_key;
    std::optional<ChangeKey> published;  // key of the last published message
    MonoNs published_at = 0;
    std::deque<std::string> events;  // keys of published events, the newest last
    std::int64_t publications = 0;
  };

  void OnMessage(Stream& stream, Bytes message, MonoNs now);
  void OnEvent(Stream& stream, const std::string& mark, Bytes message);
  [[nodiscard]] static bool Due(const Stream& stream, MonoNs now);
  void PublishHeld(Stream& stream, MonoNs now);
  void Publish(Stream& stream, Bytes message);

  TopicMap topics_;
  Sink publish_;
  MessageSink select_;  // if it is set, it receives the messages in place of publish_
  std::optional<PublicKey> bridge_key_;
  std::map<std::string, Stream, std::less<>> streams_;  // by channel; command outcomes by "COMMAND_STATUS/<device>"
  std::atomic<std::int64_t> received_ = 0;
  std::atomic<std::int64_t> lost_ = 0;
  std::atomic<std::int64_t> foreign_ = 0;
  std::atomic<std::int64_t> too_long_ = 0;
  std::atomic<std::int64_t> published_ = 0;
};

}  // namespace axlecast
