#include "tools/recorder/pre_trigger.h"

#include <axlecast/alarm_t.hpp>
#include <string_view>
#include <utility>

#include "core/messages/message.h"

namespace axlecast {
namespace {

// Anybody may invent more of both; together about 6 MB.
constexpr std::size_t kMaxChannels = 1'000;
constexpr std::size_t kMaxAlarms = 64;    // of a channel; a message of axlecast holds fewer
constexpr std::size_t kLongestName = 24;  // alarm_entry_t.lcm; std::regex recurses for each character

bool IsPresent(const alarm_entry_t& entry) {
  if (entry.name.size() > kLongestName) return false;
  return entry.state == alarm_entry_t::STATE_LIVE || entry.state == alarm_entry_t::STATE_DEVICE_LATCHED ||
         entry.state == alarm_entry_t::STATE_DRIVER_LATCHED;
}

bool IsFound(const std::regex& expression, std::string_view text) {
  try {
    return std::regex_search(text.begin(), text.end(), expression);
  } catch (const std::regex_error&) {
    return false;  // too complex for this text
  }
}

constexpr std::size_t kAllocations = 32;  // bytes of bookkeeping

}  // namespace

bool TriggerWatch::Fires(const LoggedMessage& message) {
  const std::optional<alarm_t> alarms = DecodeMessage<alarm_t>(message.data);
  if (!alarms) return IsFound(trigger_, message.channel);
  auto known = standing_.find(message.channel);
  const bool first = known == standing_.end();
  if (first) {
    if (standing_.size() >= kMaxChannels) return false;
    known = standing_.try_emplace(std::string(message.channel)).first;
  }
  bool fires = false;
  std::set<std::string> standing;
  for (const alarm_entry_t& entry : alarms->entries) {
    const bool stood = first ? entry.first_utime < began_ : known->second.contains(entry.name);
    if (!IsPresent(entry) && !(stood && entry.state == alarm_entry_t::STATE_UNKNOWN)) continue;
    if (standing.size() < kMaxAlarms) standing.insert(entry.name);
    fires = fires || (!stood && IsFound(trigger_, known->first + ' ' + entry.name));
  }
  // A message holds only the worst ones: what it does not name may stand still.
  const bool all = std::cmp_less_equal(alarms->total, alarms->entries.size());
  if (!all && standing.size() + known->second.size() <= kMaxAlarms) standing.merge(known->second);
  known->second = std::move(standing);
  return fires;
}

std::size_t TriggerWatch::remembered() const {
  std::size_t names = 0;
  for (const auto& [channel, alarms] : standing_) names += alarms.size();
  return names;
}

std::size_t MessageRing::Cost(const Entry& entry) {
  return sizeof(Entry) + kAllocations + entry.channel.size() + entry.data.size();
}

void MessageRing::Add(const LoggedMessage& message, MonoNs now) {
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

bool MessageRing::Take(LoggedMessage& message) {
  if (entries_.empty()) return false;
  bytes_ -= Cost(entries_.front());
  taken_ = std::move(entries_.front());
  entries_.pop_front();
  message = {taken_.utime, taken_.channel, taken_.data};
  return true;
}

}  // namespace axlecast
