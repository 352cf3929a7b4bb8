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

// What of a message is worth telling anew when it has changed: a state without its counters and times, a position with its
// value and flags, a trip or an outcome as such.
struct ChangeKey {
  std::string mark;
  double value = 0;  // of a position, in its unit
};

// Nothing when the message is none of this type.
[[nodiscard]] std::optional<ChangeKey> NoveltyOf(std::string_view type, Bytes message);

// Whether `newer` says something else than `older`; values that are no further apart than `deadband` say the same.
[[nodiscard]] bool Differ(const ChangeKey& newer, const ChangeKey& older, double deadband);

struct MqttFeedCounts {
  std::int64_t received = 0;   // messages of the machine
  std::int64_t lost = 0;       // of these that LCM has not brought, by their numbers
  std::int64_t foreign = 0;    // of other names, damaged, or not signed by the machine's bridge
  std::int64_t too_long = 0;   // as JSON
  std::int64_t published = 0;  // given to `publish`
};

// The machine's messages from LCM, thinned out and as JSON. Pure: time is an argument. counts() is thread-safe, the rest
// belongs to one thread.
class MqttFeed {
 public:
  using Sink = std::function<void(BrokerMessage message, RetentionClass keeping)>;

  MqttFeed(const MachineConfig& machine, Sink publish);

  void OnData(const std::string& channel, Bytes message, MonoNs now);
  void OnCommandStatus(Bytes message, MonoNs now);
  // Publishes what has waited for its time. At least ten times a second.
  void Poll(MonoNs now);
  // Publishes what waits for its time yet.
  void Flush();
  // A broker that was away may have forgotten what it kept: the next message of each state is published.
  void TellStatesAnew();

  [[nodiscard]] const TopicMap& topics() const { return topics_; }
  [[nodiscard]] MqttFeedCounts counts() const;

 private:
  struct Stream {
    MqttTopic topic;
    SequenceCount sequence;
    std::vector<std::uint8_t> held;  // the newest that is not published; empty: none
    ChangeKey held_novelty;
    std::optional<ChangeKey> published;  // what the newest published one says
    MonoNs published_at = 0;
    std::deque<std::string> events;  // marks of those published, the newest last
    std::int64_t publications = 0;
  };

  void OnMessage(Stream& stream, Bytes message, MonoNs now);
  void OnEvent(Stream& stream, const std::string& mark, Bytes message);
  [[nodiscard]] static bool Due(const Stream& stream, MonoNs now);
  void PublishHeld(Stream& stream, MonoNs now);
  void Publish(Stream& stream, Bytes message);

  TopicMap topics_;
  Sink publish_;
  std::optional<PublicKey> bridge_key_;
  std::map<std::string, Stream, std::less<>> streams_;  // by channel; command outcomes by "COMMAND_STATUS/<device>"
  std::atomic<std::int64_t> received_ = 0;
  std::atomic<std::int64_t> lost_ = 0;
  std::atomic<std::int64_t> foreign_ = 0;
  std::atomic<std::int64_t> too_long_ = 0;
  std::atomic<std::int64_t> published_ = 0;
};

}  // namespace axlecast
