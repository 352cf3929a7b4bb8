#include "tools/recorder/log_composer.h"

#include <algorithm>
#include <axlecast/alarm_t.hpp>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/permit_t.hpp>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"
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

// Space that is reserved in every log for its last seal.
constexpr std::uint64_t kSealSize = kEventHeader + kSealChannel.size() + 20;

// Returns true for the types that every client numbers for itself.
bool IsOfClient(Bytes message) {
  const std::optional<std::int64_t> type = Fingerprint(message);
  return type == command_t::getHash() || type == permit_t::getHash() || type == driver_command_t::getHash();
}

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

void ChannelLosses::On(const LogEvent& message) {
  const std::optional<MessageHead> head = HeadOf(message.data);
  if (!head || IsOfClient(message.data)) return;
  auto channel = channels_.find(message.channel);
  if (channel == channels_.end()) {
    if (channels_.size() >= kMaxChannels) return;
    channel = channels_.emplace(message.channel, SequenceCount()).first;
  }
  channel->second.On(head->boot_id, head->seq);
}

std::vector<ChannelLoss> ChannelLosses::losses() const {
  std::vector<ChannelLoss> losses;
  for (const auto& [channel, count] : channels_) {
    if (count.lost() > 0) losses.push_back({channel, count.received(), count.lost()});
  }
  std::stable_sort(losses.begin(), losses.end(),
                   [](const ChannelLoss& one, const ChannelLoss& other) { return one.lost > other.lost; });
  return losses;
}

LogComposer::LogComposer(RecorderSettings settings, LogSink& output)
    : settings_(std::move(settings)), output_(output) {
  if (!settings_.pre_trigger) return;
  const PreTrigger& pre_trigger = *settings_.pre_trigger;
  ring_.emplace(pre_trigger.before, pre_trigger.memory);
}

void LogComposer::Start(MonoNs now, std::int64_t utime) {
  if (settings_.pre_trigger) {
    trigger_.emplace(settings_.pre_trigger->trigger, utime);
  } else {
    BeginLog(now, utime, {});
  }
}

void LogComposer::Continue(const LogTail& tail, MonoNs now, std::int64_t utime) { BeginLog(now, utime, tail); }

void LogComposer::BeginLog(MonoNs now, std::int64_t utime, const LogTail& tail) {
  output_.Begin(utime);
  encoder_ = LogEncoder(tail.next_number, tail.size, tail.open);
  log_began_ = now;
  log_has_messages_ = false;
  next_seal_ = now + kSealInterval;
  recording_ = true;
  const auto write = [&](std::string_view channel, std::string_view text) {
    Write(encoder_.Add({.utime = utime, .channel = channel, .data = AsBytes(text)}));
  };
  const LogIdentity& identity = settings_.identity;
  const nlohmann::ordered_json recorder = {
      {"version", AXLECAST_VERSION}, {"name", identity.name},     {"host", identity.host}, {"urls", identity.urls},
      {"channel", identity.channel}, {"invert", identity.invert}, {"start_utime", utime},  {"file_number", logs_}};
  // Host and name may contain bytes that are not UTF-8.
  write(kRecorderChannel, recorder.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  if (!identity.machine.empty()) write(kMachineChannel, identity.machine);
  write(kSchemaChannel, SchemaText());
  ++logs_;
}

void LogComposer::EndLog(std::int64_t utime) {
  Write(encoder_.Seal(utime));
  output_.End();
  recording_ = false;
  next_seal_ = kNever;
}

void LogComposer::Write(Bytes record) {
  if (record.empty()) return;
  bytes_ += static_cast<std::int64_t>(record.size());
  output_.Write(record);
}

void LogComposer::On(const LogEvent& message, MonoNs now) {
  if (!trigger_) {
    Record(message, now);
    return;
  }
  const bool fires = trigger_->Fires(message);
  if (!recording_ && !fires) {
    ring_->Add(message, now);
    return;
  }
  if (!recording_) Fire(now, message.utime);
  if (fires) record_until_ = now + settings_.pre_trigger->after;
  Record(message, now);
}

void LogComposer::Fire(MonoNs now, std::int64_t utime) {
  ring_->Expire(now);
  std::optional<LogEvent> message = ring_->Take();
  BeginLog(now, message ? message->utime : utime, {});
  for (; message; message = ring_->Take()) Record(*message, now);
}

bool LogComposer::MustSplit(const LogEvent& message, MonoNs now) const {
  if (!log_has_messages_) return false;
  if (settings_.split_time > 0 && now - log_began_ >= settings_.split_time) return true;
  const std::uint64_t size = EventSize(message) + kSealSize;
  return settings_.split_bytes > 0 && encoder_.bytes() + size > settings_.split_bytes;
}

void LogComposer::Record(const LogEvent& message, MonoNs now) {
  if (MustSplit(message, now)) {
    EndLog(message.utime);
    BeginLog(now, message.utime, {});
  }
  Write(encoder_.Add(message));
  channels_.On(message);
  log_has_messages_ = true;
  ++messages_;
}

void LogComposer::Poll(MonoNs now, std::int64_t utime) {
  if (!recording_) return;
  if (now >= record_until_) {
    record_until_ = kNever;
    EndLog(utime);
  } else if (now >= next_seal_) {
    Write(encoder_.Seal(utime));
    next_seal_ = now + kSealInterval;
  }
}

MonoNs LogComposer::next_poll() const { return std::min(next_seal_, record_until_); }

void LogComposer::End(std::int64_t utime) {
  if (recording_) EndLog(utime);
}

}  // namespace axlecast
