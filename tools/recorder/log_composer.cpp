#include "tools/recorder/log_composer.h"

#include <algorithm>
#include <axlecast/command_t.hpp>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/permit_t.hpp>
#include <nlohmann/json.hpp>

#include "core/messages/json/field.h"
#include "core/messages/json/message_json.h"

namespace axlecast {
namespace {

// Space that is reserved in every log for its last seal.
constexpr std::uint64_t kSealSize = kEventHeader + kSealChannel.size() + 20;

// Returns true for the types that every client numbers for itself.
bool IsOfClient(Bytes message) {
  const std::optional<std::int64_t> type = Fingerprint(message);
  return type == command_t::getHash() || type == permit_t::getHash() || type == driver_command_t::getHash();
}

}  // namespace

std::vector<std::pair<std::string, std::string>> HeaderEvents(const LogIdentity& identity, std::int64_t utime,
                                                              std::int64_t number) {
  const nlohmann::ordered_json recorder = {
      {"version", AXLECAST_VERSION}, {"name", identity.name},     {"host", identity.host}, {"urls", identity.urls},
      {"channel", identity.channel}, {"invert", identity.invert}, {"start_utime", utime},  {"file_number", number}};
  std::vector<std::pair<std::string, std::string>> events;
  // Host and name may contain bytes that are not UTF-8.
  constexpr auto kReplace = nlohmann::ordered_json::error_handler_t::replace;
  events.emplace_back(kRecorderChannel, recorder.dump(-1, ' ', false, kReplace));
  if (!identity.machine.empty()) events.emplace_back(kMachineChannel, identity.machine);
  events.emplace_back(kSchemaChannel, SchemaText());
  return events;
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
  for (const auto& [channel, text] : HeaderEvents(settings_.identity, utime, logs_)) {
    Write(encoder_.Add({.utime = utime, .channel = channel, .data = AsBytes(text)}));
  }
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
