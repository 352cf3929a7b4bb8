#include "tools/mqtt/mqtt_feed.h"

#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/motor_health_t.hpp>
#include <axlecast/motor_limits_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/recorder_health_t.hpp>
#include <axlecast/trip_log_t.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "core/command/keys.h"
#include "core/messages/json/field.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

// Flags that change between readings.
constexpr std::int32_t kTransientFlags = std::int32_t{position_t::FLAG_AFTER_GAP} |
                                         std::int32_t{position_t::FLAG_CLOCK_STEPPED} |
                                         std::int32_t{position_t::FLAG_SPEED_VALID};

std::string Joined(const std::string& text) { return text + '\0'; }
template <typename Number>
std::string Joined(Number number) {
  return std::to_string(number) + ' ';
}
template <typename... Parts>
std::string Mark(const Parts&... parts) {
  return (Joined(parts) + ...);
}

ChangeKey Of(const position_t& m) { return {Mark(m.boot_id, m.datum_epoch, m.flags & ~kTransientFlags), m.value}; }
ChangeKey Of(const motor_health_t& m) { return {Mark(m.boot_id, m.seq), 0}; }
ChangeKey Of(const alarm_t& m) { return {Mark(m.boot_id, m.revision), 0}; }
ChangeKey Of(const device_info_t& m) {
  return {Mark(m.boot_id, m.state, m.reason, m.model, m.serial, m.firmware, m.product_code, m.identity,
               m.config_hash, m.datum_epoch, m.reference_lost, m.nv_writes),
          0};
}
ChangeKey Of(const motor_limits_t& m) {
  std::string values(sizeof m.parameters, '\0');
  std::memcpy(values.data(), m.parameters, sizeof m.parameters);
  return {Mark(m.boot_id, m.power_upper_w[0], m.power_upper_w[1], m.power_lower_w[0], m.power_lower_w[1],
               m.start_time_s, m.shock_time_upper_s[0], m.shock_time_upper_s[1], m.shock_time_lower_s[0],
               m.shock_time_lower_s[1]) +
              values,
          0};
}
ChangeKey Of(const bus_health_t& m) { return {Mark(m.boot_id, m.state, m.reopens), 0}; }
ChangeKey Of(const recorder_health_t& m) { return {Mark(m.boot_id, m.state, m.file, m.lost, m.last_error), 0}; }
// A trip is repeated, also after a restart of its driver: boot id and time are excluded.
ChangeKey Of(const trip_log_t& m) {
  std::string samples(sizeof m.samples, '\0');
  std::memcpy(samples.data(), m.samples, sizeof m.samples);
  return {Mark(m.trip_count, m.factor_bits, m.interval_us, m.valid_mask) + samples, 0};
}
ChangeKey Of(const command_status_t& m) {
  std::string id(sizeof m.id, '\0');
  std::memcpy(id.data(), m.id, sizeof m.id);
  return {id + Mark(m.state, m.finding), 0};
}

template <typename Message>
std::optional<ChangeKey> Decoded(Bytes bytes) {
  const std::optional<Message> message = DecodeMessage<Message>(bytes);
  return message ? std::optional(Of(*message)) : std::nullopt;
}

constexpr std::size_t kEventsKnown = 256;  // of each device; events are repeated for a while

}  // namespace

std::optional<ChangeKey> ChangeKeyOf(std::string_view type, Bytes message) {
  using Decode = std::optional<ChangeKey> (*)(Bytes);
  static constexpr std::pair<std::string_view, Decode> kTypes[] = {
      {"position_t", &Decoded<position_t>},
      {"motor_health_t", &Decoded<motor_health_t>},
      {"motor_limits_t", &Decoded<motor_limits_t>},
      {"alarm_t", &Decoded<alarm_t>},
      {"device_info_t", &Decoded<device_info_t>},
      {"bus_health_t", &Decoded<bus_health_t>},
      {"trip_log_t", &Decoded<trip_log_t>},
      {"recorder_health_t", &Decoded<recorder_health_t>},
      {"command_status_t", &Decoded<command_status_t>}};
  for (const auto& [name, decode] : kTypes) {
    if (name == type) return decode(message);
  }
  return std::nullopt;
}

bool Differ(const ChangeKey& newer, const ChangeKey& older, double deadband) {
  if (newer.mark != older.mark) return true;
  if (std::isnan(newer.value) || std::isnan(older.value)) return std::isnan(newer.value) != std::isnan(older.value);
  return std::abs(newer.value - older.value) > deadband;
}

MqttFeed::MqttFeed(const MachineConfig& machine, Sink publish)
    : topics_(machine), publish_(std::move(publish)), bridge_key_(machine.bridge.bridge.public_key) {}

MqttFeed::MqttFeed(const MachineConfig& machine, MessageSink select)
    : topics_(machine), select_(std::move(select)), bridge_key_(machine.bridge.bridge.public_key) {}

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
    stream->second.channel = channel;
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
  const std::string channel = "COMMAND_STATUS/" + status->device;
  Stream& stream = streams_[channel];
  stream.channel = channel;
  if (stream.topic.topic.empty()) stream.topic = std::move(*topic);
  OnMessage(stream, message, now);
}

void MqttFeed::OnMessage(Stream& stream, Bytes message, MonoNs now) {
  std::optional<ChangeKey> key = ChangeKeyOf(stream.topic.type, message);
  const std::optional<MessageHead> head = ReadHead(message);
  if (!key || !head) {
    ++foreign_;
    return;
  }
  ++received_;
  if (stream.topic.keeping == RetentionClass::kEvents) return OnEvent(stream, key->mark, message);
  const std::int64_t lost = stream.sequence.lost();
  stream.sequence.On(head->boot_id, head->seq);
  lost_ += stream.sequence.lost() - lost;
  stream.held.assign(message.begin(), message.end());
  stream.held_key = std::move(*key);
  if (Due(stream, now)) PublishHeld(stream, now);
}

// Sequence numbers are not counted: outcomes of all devices share one channel.
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
  return age >= pace.longest || (age >= pace.interval && Differ(stream.held_key, *stream.published, pace.deadband));
}

void MqttFeed::Poll(MonoNs now) {
  for (auto& [channel, stream] : streams_) {
    if (!stream.held.empty() && Due(stream, now)) PublishHeld(stream, now);
  }
}

void MqttFeed::Flush() {
  for (auto& [channel, stream] : streams_) {
    if (!stream.held.empty() && stream.published &&
        Differ(stream.held_key, *stream.published, stream.topic.pace.deadband)) {
      PublishHeld(stream, stream.published_at);
    }
  }
}

void MqttFeed::RepublishStates() {
  for (auto& [channel, stream] : streams_) {
    if (stream.topic.retain) stream.published.reset();
  }
}

void MqttFeed::PublishHeld(Stream& stream, MonoNs now) {
  Publish(stream, stream.held);
  stream.held.clear();
  stream.published = std::move(stream.held_key);
  stream.published_at = now;
}

void MqttFeed::Publish(Stream& stream, Bytes message) {
  if (select_) {
    ++published_;
    return select_(stream.channel, message);
  }
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
