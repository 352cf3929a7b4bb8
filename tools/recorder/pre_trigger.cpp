#include "tools/recorder/pre_trigger.h"

#include <axlecast/alarm_t.hpp>
#include <string_view>

#include "core/messages/message.h"

namespace axlecast {
namespace {

// Senders can invent any number of both. Together: about 6 MB.
constexpr std::size_t kMaxChannels = 1'000;
constexpr std::size_t kMaxAlarms = 64;    // of a channel; a message of axlecast holds fewer
constexpr std::size_t kLongestName = 24;  // alarm_entry_t.lcm; std::regex recurses for each character

bool IsPresent(const alarm_entry_t& entry) {
  if (entry.name.size() > kLongestName) return false;
  return entry.state == alarm_entry_t::STATE_LIVE || entry.state == alarm_entry_t::STATE_DEVICE_LATCHED ||
         entry.state == alarm_entry_t::STATE_DRIVER_LATCHED;
}

bool IsMatch(const std::regex& expression, std::string_view text) {
  try {
    return std::regex_search(text.begin(), text.end(), expression);
  } catch (const std::regex_error&) {
    return false;  // the expression is too complex for this text
  }
}

constexpr std::size_t kAllocations = 32;  // bytes of overhead for the two allocations of an entry

}  // namespace

bool TriggerWatch::Fires(const LogEvent& message) {
  const std::optional<alarm_t> alarms = DecodeMessage<alarm_t>(message.data);
  if (!alarms) return IsMatch(trigger_, message.channel);
  auto known = present_.find(message.channel);
  const bool first = known == present_.end();
  if (first) {
    if (present_.size() >= kMaxChannels) return false;
    known = present_.try_emplace(std::string(message.channel)).first;
  }
  bool fires = false;
  std::set<std::string> present;
  for (const alarm_entry_t& entry : alarms->entries) {
    const bool was_present = first ? entry.first_utime < began_ : known->second.contains(entry.name);
    if (!IsPresent(entry) && !(was_present && entry.state == alarm_entry_t::STATE_UNKNOWN)) continue;
    if (present.size() < kMaxAlarms) present.insert(entry.name);
    fires = fires || (!was_present && IsMatch(trigger_, known->first + ' ' + entry.name));
  }
  // A message contains only the most severe alarms: an alarm that it does not name may still be present.
  const bool all = std::cmp_less_equal(alarms->total, alarms->entries.size());
  if (!all && present.size() + known->second.size() <= kMaxAlarms) present.merge(known->second);
  known->second = std::move(present);
  return fires;
}

std::size_t TriggerWatch::remembered() const {
  std::size_t names = 0;
  for (const auto& [channel, alarms] : present_) names += alarms.size();
  return names;
}

std::size_t MessageRing::Cost(const Entry& entry) {
  return sizeof(Entry) + kAllocations + entry.channel.size() + entry.data.size();
}

void MessageRing::Add(const LogEvent& message, MonoNs now) {
  Entry entry{now, message.utime, std::string(message.channel), {message.data.begin(), message.data.end()}};
  bytes_ += Cost(entry);
  entries_.push_back(std::move(entry));
  Expire(now);
  while (bytes_ > limit_ && !entries_.empty()) {
    ++early_;
    Drop();
  }
}

void MessageRing::Expire(MonoNs now) {
  while (!entries_.empty() && entries_.front().at < now - span_) Drop();
}

void MessageRing::Drop() {
  bytes_ -= Cost(entries_.front());
  entries_.pop_front();
}

std::optional<LogEvent> MessageRing::Take() {
  if (entries_.empty()) return std::nullopt;
  bytes_ -= Cost(entries_.front());
  taken_ = std::move(entries_.front());
  entries_.pop_front();
  return LogEvent{.utime = taken_.utime, .channel = taken_.channel, .data = taken_.data};
}

}  // namespace axlecast
