#include "tools/axlecast/logs/log_summary.h"

#include <algorithm>
#include <string_view>

#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
#include "tools/log/log_event.h"
#include "tools/log/log_seal.h"

namespace axlecast {
namespace {

// Times of a damaged log can be any numbers.
std::int64_t Since(std::int64_t before, std::int64_t utime) {
  std::int64_t since = 0;
  return __builtin_sub_overflow(utime, before, &since) ? 0 : since;
}

}  // namespace

double LogSummary::Channel::Hz() const {
  const std::int64_t span = Since(first, last);
  return span > 0 ? static_cast<double>(count - 1) * 1e6 / static_cast<double>(span) : 0;
}

void LogSummary::Add(const LogEvent& event) {
  first_ = events_ == 0 ? event.utime : std::min(first_, event.utime);
  last_ = events_ == 0 ? event.utime : std::max(last_, event.utime);
  ++events_;
  auto found = channels_.find(event.channel);
  if (found == channels_.end()) found = channels_.emplace(event.channel, Channel{}).first;
  Channel& channel = found->second;
  if (channel.count == 0) channel.first = event.utime;
  if (const std::int64_t gap = Since(channel.last, event.utime); channel.count > 0 && gap > channel.largest_gap) {
    channel.largest_gap = gap;
    channel.gap_at = channel.last;
  }
  channel.last = event.utime;
  ++channel.count;
  channel.bytes += EventSize(event);
  if (event.channel == kSealChannel) return;
  if (IsLogChannel(event.channel)) {
    headers_.insert_or_assign(std::string(event.channel), std::string(event.data.begin(), event.data.end()));
  } else {
    AddMessage(event, channel);
  }
}

void LogSummary::AddMessage(const LogEvent& event, Channel& channel) {
  const std::optional<MessageHead> head = HeadOf(event.data);
  if (!head) return;
  channel.sequence.On(head->boot_id, head->seq);
  const bool recorder = event.channel.starts_with("RECORDER/");
  if (!recorder && !channel.type.empty()) return;
  std::string type;
  const auto json = DecodeToJson(event.data, &type);
  if (!json) return;
  channel.type = type;
  if (type == "recorder_health_t") recorders_.insert_or_assign(std::string(event.channel), *json);
}

std::int64_t LogSummary::lost() const {
  std::int64_t lost = 0;
  for (const auto& [name, channel] : channels_) lost += channel.sequence.lost();
  return lost;
}

std::optional<std::string> LogSummary::Header(std::string_view channel) const {
  const auto found = headers_.find(channel);
  return found == headers_.end() ? std::nullopt : std::optional(found->second);
}

}  // namespace axlecast
