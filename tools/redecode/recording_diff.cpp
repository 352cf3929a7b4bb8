#include "tools/redecode/recording_diff.h"

#include <axlecast/motor_health_t.hpp>
#include <axlecast/position_t.hpp>
#include <optional>
#include <utility>

#include "core/messages/json/message_json.h"
#include "core/messages/message.h"

namespace axlecast {
namespace {

// Returns the sampling time and the message without the fields that must differ.
template <typename Message>
std::optional<std::pair<MonoNs, std::vector<std::uint8_t>>> Comparable(Bytes bytes) {
  std::optional<Message> message = DecodeMessage<Message>(bytes);
  if (!message) return std::nullopt;
  message->seq = 0;
  message->flags &= ~Message::FLAG_REDECODED;
  return std::pair(message->mono_ns, Encoded(*message));
}

}  // namespace

void RecordingDiff::Add(const std::string& channel, Bytes message, Side side) {
  auto comparable = Comparable<position_t>(message);
  if (!comparable) comparable = Comparable<motor_health_t>(message);
  if (!comparable) return;
  Channel& found = channels_[channel];
  found.waiting[side].push_back({comparable->first, std::move(comparable->second)});
  Match(found);
}

// If one side has passed a time, the other side has no reading of that time.
void RecordingDiff::Match(Channel& channel) {
  auto& [recorded, redecoded] = channel.waiting;
  while (!recorded.empty() && !redecoded.empty()) {
    const MonoNs apart = recorded.front().mono_ns - redecoded.front().mono_ns;
    if (apart < 0) ++channel.tally.only_recorded;
    if (apart > 0) ++channel.tally.only_redecoded;
    if (apart == 0) Compare(recorded.front(), redecoded.front(), channel.tally);
    if (apart <= 0) recorded.pop_front();
    if (apart >= 0) redecoded.pop_front();
  }
}

void RecordingDiff::Compare(const Reading& recorded, const Reading& redecoded, Tally& tally) {
  if (recorded.message == redecoded.message) {
    ++tally.equal;
    return;
  }
  ++tally.differing;
  if (tally.first.size() >= kShown) return;
  Difference difference{.mono_ns = recorded.mono_ns, .fields = {}};
  std::string type;
  const auto before = DecodeToJson(recorded.message, &type);
  const auto after = DecodeToJson(redecoded.message, &type);
  for (const auto& [name, value] : before->items()) {
    if (after->at(name) != value) difference.fields.push_back({name, value, after->at(name)});
  }
  tally.first.push_back(std::move(difference));
}

void RecordingDiff::Finish() {
  for (auto& [name, channel] : channels_) {
    channel.tally.only_recorded += static_cast<std::int64_t>(channel.waiting[kRecorded].size());
    channel.tally.only_redecoded += static_cast<std::int64_t>(channel.waiting[kRedecoded].size());
    for (auto& waiting : channel.waiting) waiting.clear();
  }
}

std::map<std::string, RecordingDiff::Tally> RecordingDiff::tallies() const {
  std::map<std::string, Tally> tallies;
  for (const auto& [name, channel] : channels_) tallies.emplace(name, channel.tally);
  return tallies;
}

bool RecordingDiff::same() const {
  for (const auto& [name, channel] : channels_) {
    if (!channel.tally.same()) return false;
  }
  return true;
}

}  // namespace axlecast
