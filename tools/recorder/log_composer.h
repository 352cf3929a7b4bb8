#pragma once

#include <cstdint>
#include <optional>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "tools/log/log_event.h"
#include "tools/log/log_seal.h"
#include "tools/recorder/channel_losses.h"
#include "tools/recorder/message_queue.h"
#include "tools/recorder/pre_trigger.h"

namespace axlecast {

// Where the logs of a recording go, one after the other.
class LogSink {
 public:
  virtual ~LogSink() = default;
  virtual void Begin(std::int64_t utime) = 0;  // a log begins; us, UNIX time
  virtual void Write(Bytes record) = 0;        // one whole record
  virtual void End() = 0;                      // the log is complete
};

// What every log of a recording begins with (tools/log/log_header.h).
struct LogIdentity {
  std::string name;  // of the recorder
  std::string host;
  std::string machine;  // the machine's file as text; empty: there is none
  std::vector<std::string> urls;
  std::string channel;  // --channel; empty: all
  bool invert = false;
};

// Channel and content of each header event of the recording's log `number` (from 0), which begins at `utime` (us, UNIX).
[[nodiscard]] std::vector<std::pair<std::string, std::string>> HeaderEvents(const LogIdentity& identity,
                                                                            std::int64_t utime,
                                                                            std::int64_t number);

// All of lcmtypes/*.lcm, each behind a line "// <file>".
[[nodiscard]] const std::string& SchemaText();

// The records of one log: numbers its events and seals them.
class LogEventEncoder {
 public:
  LogEventEncoder() = default;
  // Goes on with a log that ends so.
  explicit LogEventEncoder(const LogTail& tail) : number_(tail.next_number), bytes_(tail.size), open_(tail.open) {}

  // The event's record, until the next call.
  [[nodiscard]] Bytes Add(const LoggedMessage& message);
  // A seal over what was added since the one before; no bytes where nothing was.
  [[nodiscard]] Bytes Seal(std::int64_t utime);

  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  void Write(const LoggedMessage& message);

  std::int64_t number_ = 0;  // of the next event
  std::uint64_t bytes_ = 0;
  SealCount open_;
  std::vector<std::uint8_t> record_;
};

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
