#include "tools/mqtt/mqtt_feed.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/command/signature.h"
#include "core/messages/json/field.h"
#include "core/messages/message.h"
#include "tools/mqtt/mqtt_payload.h"

namespace axlecast {
namespace {

constexpr std::size_t kEventsKnown = 256;  // of each device: those are told again for a while

}  // namespace

MqttFeed::MqttFeed(const MachineConfig& machine, Sink publish)
    : topics_(machine), publish_(std::move(publish)), bridge_key_(machine.bridge.bridge.public_key) {}

void MqttFeed::OnData(const std::string& channel, Bytes message, MonoNs now) {
  auto stream = streams_.find(channel);
  if (stream == streams_.end()) {
    std::optional<MqttTopic> topic = topics_.Find(channel);
    if (!topic) {
      ++foreign_;
      return;
    }
    stream = streams_.emplace(channel, Stream{}).first;
    stream->second.topic = std::move(*topic);
  }
  OnMessage(stream->second, message, now);
}

void MqttFeed::OnCommandStatus(Bytes message, MonoNs now) {
  const auto status = DecodeMessage<command_status_t>(message);
  if (status && status->is_final == 0) return;
  std::optional<MqttTopic> topic = status ? topics_.CommandTopic(status->device) : std::nullopt;
  if (!topic || (bridge_key_ && !VerifyMessage(*bridge_key_, Domain::kStatus, *status))) {
    ++foreign_;
    return;
  }
  Stream& stream = streams_["COMMAND_STATUS/" + status->device];
  if (stream.topic.topic.empty()) stream.topic = std::move(*topic);
  OnMessage(stream, message, now);
}

void MqttFeed::OnMessage(Stream& stream, Bytes message, MonoNs now) {
  std::optional<ChangeKey> novelty = NoveltyOf(stream.topic.type, message);
  const std::optional<MessageHead> head = ReadHead(message);
  if (!novelty || !head) {
    ++foreign_;
    return;
  }
  ++received_;
  if (stream.topic.keeping == RetentionClass::kEvents) return OnEvent(stream, novelty->mark, message);
  const std::int64_t lost = stream.sequence.lost();
  stream.sequence.On(head->boot_id, head->seq);
  lost_ += stream.sequence.lost() - lost;
  stream.held.assign(message.begin(), message.end());
  stream.held_novelty = std::move(*novelty);
  if (Due(stream, now)) PublishHeld(stream, now);
}

// Outcomes of several devices share one channel, so their numbers tell nothing of a device's.
void MqttFeed::OnEvent(Stream& stream, const std::string& mark, Bytes message) {
  std::deque<std::string>& known = stream.events;
  if (std::find(known.begin(), known.end(), mark) != known.end()) return;
  known.push_back(mark);
  if (known.size() > kEventsKnown) known.pop_front();
  Publish(stream, message);
}

bool MqttFeed::Due(const Stream& stream, MonoNs now) {
  if (!stream.published) return true;
  const PositionPace& pace = stream.topic.pace;
  const MonoNs age = now - stream.published_at;
  return age >= pace.longest ||
         (age >= pace.interval && Differ(stream.held_novelty, *stream.published, pace.deadband));
}

void MqttFeed::Poll(MonoNs now) {
  for (auto& [channel, stream] : streams_) {
    if (!stream.held.empty() && Due(stream, now)) PublishHeld(stream, now);
  }
}

void MqttFeed::Flush() {
  for (auto& [channel, stream] : streams_) {
    if (!stream.held.empty() && stream.published &&
        Differ(stream.held_novelty, *stream.published, stream.topic.pace.deadband)) {
      PublishHeld(stream, stream.published_at);
    }
  }
}

void MqttFeed::TellStatesAnew() {
  for (auto& [channel, stream] : streams_) {
    if (stream.topic.retain) stream.published.reset();
  }
}

void MqttFeed::PublishHeld(Stream& stream, MonoNs now) {
  Publish(stream, stream.held);
  stream.held.clear();
  stream.published = std::move(stream.held_novelty);
  stream.published_at = now;
}

void MqttFeed::Publish(Stream& stream, Bytes message) {
  std::optional<nlohmann::ordered_json> json = MqttPayload(stream.topic.type, message);
  if (!json) return;
  (*json)["publication"] = stream.publications++;
  std::string text = JsonLine(*json);
  if (text.size() > kLongestPayload) {
    ++too_long_;
    return;
  }
  ++published_;
  publish_({stream.topic.topic, std::move(text), stream.topic.retain}, stream.topic.keeping);
}

MqttFeedCounts MqttFeed::counts() const {
  return {
      .received = received_, .lost = lost_, .foreign = foreign_, .too_long = too_long_, .published = published_};
}

}  // namespace axlecast
