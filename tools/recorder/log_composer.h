#pragma once

#include <cstdint>
#include <optional>
#include <regex>

#include "core/base/time.h"
#include "tools/recorder/channel_losses.h"
#include "tools/recorder/log_event_encoder.h"
#include "tools/recorder/log_identity.h"
#include "tools/recorder/log_sink.h"
#include "tools/recorder/message_ring.h"
#include "tools/recorder/trigger_watch.h"

namespace axlecast {

// Records only around what triggers.
struct PreTrigger {
  std::regex trigger;               // TriggerWatch
  MonoNs before = 0;                // what came so long before it,
  MonoNs after = 0;                 // and so long after the last one
  std::size_t memory = 256U << 20;  // bytes for what came before
};

struct RecorderSettings {
  LogIdentity identity;
  std::uint64_t split_bytes = 0;  // a log grows no longer; 0: any size
  MonoNs split_time = 0;          // nor older; 0: any age
  std::optional<PreTrigger> pre_trigger;
};

// Turns messages into logs: header events, numbers, seals once a second and at the end, one log after the other. Pure:
// time is an argument, and bytes go to a LogSink.
class LogComposer {
 public:
  static constexpr MonoNs kSealInterval = kSecond;

  LogComposer(RecorderSettings settings, LogSink& output);

  // Begins the first log; with a pre-trigger it begins when that fires.
  void Start(MonoNs now, std::int64_t utime);
  // Instead of Start, without a pre-trigger: goes on with a log that exists. Its header events are written there too.
  void Continue(const LogTail& tail, MonoNs now, std::int64_t utime);

  void On(const LoggedMessage& message, MonoNs now);
  // What is due.
  void Poll(MonoNs now, std::int64_t utime);
  [[nodiscard]] MonoNs next_poll() const;
  // Completes the log.
  void End(std::int64_t utime);

  [[nodiscard]] bool recording() const { return recording_; }        // else it waits for the trigger
  [[nodiscard]] std::int64_t messages() const { return messages_; }  // written, without header events and seals
  [[nodiscard]] std::int64_t bytes() const { return bytes_; }        // of all logs
  [[nodiscard]] std::int64_t early() const { return ring_ ? ring_->early() : 0; }  // MessageRing
  [[nodiscard]] const ChannelLosses& channels() const { return channels_; }

 private:
  void BeginLog(MonoNs now, std::int64_t utime, const LogTail& tail);
  void EndLog(std::int64_t utime);
  void Fire(MonoNs now, std::int64_t utime);
  void Record(const LoggedMessage& message, MonoNs now);
  [[nodiscard]] bool MustSplit(const LoggedMessage& message, MonoNs now) const;
  void Write(Bytes record);

  RecorderSettings settings_;
  LogSink& output_;
  LogEventEncoder stream_;
  std::optional<TriggerWatch> trigger_;
  std::optional<MessageRing> ring_;
  ChannelLosses channels_;
  bool recording_ = false;
  bool log_has_messages_ = false;
  std::int64_t logs_ = 0;
  std::int64_t messages_ = 0;
  std::int64_t bytes_ = 0;
  MonoNs log_began_ = 0;
  MonoNs next_seal_ = kNever;
  MonoNs record_until_ = kNever;
};

}  // namespace axlecast
