#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/messages/sequence_count.h"
#include "tools/log/log_event.h"
#include "tools/log/log_reader.h"
#include "tools/recorder/message_receiver.h"

namespace axlecast {

// Settings of a recording that stores only the messages around a trigger.
struct PreTrigger {
  std::regex trigger;               // see TriggerWatch
  MonoNs before = 0;                // messages of this time before the trigger are stored
  MonoNs after = 0;                 // messages of this time after the last trigger are stored
  std::size_t memory = 256U << 20;  // bytes for messages before the trigger
};

// Detects the trigger of a recording.
// - An alarm triggers when it appears, if the expression matches in "<channel> <alarm's name>", e.g. "ALARM/axis1 battery_error".
//   An alarm that was present before the watch began does not trigger.
// - A message of any other type triggers each time, if the expression matches in its channel's name.
class TriggerWatch {
 public:
  // `utime`: the time at which the watch begins (us, UNIX time).
  TriggerWatch(std::regex trigger, std::int64_t utime) : trigger_(std::move(trigger)), began_(utime) {}

  [[nodiscard]] bool Fires(const LogEvent& message);
  [[nodiscard]] std::size_t remembered() const;  // number of stored alarm names, over all channels

 private:
  std::regex trigger_;
  std::int64_t began_;
  std::map<std::string, std::set<std::string>, std::less<>>
      present_;  // names of the present alarms of each channel
};

// Stores the messages of the last seconds in limited memory. If the memory is full, the oldest messages are removed early.
class MessageRing {
 public:
  MessageRing(MonoNs span, std::size_t limit) : span_(span), limit_(limit) {}

  void Add(const LogEvent& message, MonoNs now);
  // Removes messages that are older than the span.
  void Expire(MonoNs now);
  // Removes and returns the oldest message, or nothing if the ring is empty. Its views are valid until the next call.
  [[nodiscard]] std::optional<LogEvent> Take();
  // Returns the number of messages that were removed early.
  [[nodiscard]] std::int64_t early() const { return early_; }

 private:
  struct Entry {
    MonoNs at;
    std::int64_t utime;
    std::string channel;
    std::vector<std::uint8_t> data;
  };

  [[nodiscard]] static std::size_t Cost(const Entry& entry);
  void Drop();

  MonoNs span_;
  std::size_t limit_;
  std::size_t bytes_ = 0;
  std::int64_t early_ = 0;
  std::deque<Entry> entries_;
  Entry taken_{};
};

// Receives the logs of a recording, one after the other.
class LogSink {
 public:
  virtual ~LogSink() = default;
  virtual void Begin(std::int64_t utime) = 0;  // begins a log; us, UNIX time
  virtual void Write(Bytes record) = 0;        // one complete record
  virtual void End() = 0;                      // completes the log
};

// The content of the header events of every log of a recording (tools/log/log_event.h).
struct LogIdentity {
  std::string name;  // name of the recorder
  std::string host;
  std::string machine;  // text of the machine's file; empty: there is no file
  std::vector<std::string> urls;
  std::string channel;  // --channel; empty: all channels
  bool invert = false;
};

// Returns the text of all lcmtypes/*.lcm, each after a line "// <file>".
[[nodiscard]] const std::string& SchemaText();

struct ChannelLoss {
  std::string channel;
  std::int64_t received = 0;
  std::int64_t lost = 0;
};

// Counts the missing messages of each channel by the `seq` of axlecast's own types. It shows which channels a loss concerns.
// Messages of other types, and types that every client numbers for itself, are ignored.
class ChannelLosses {
 public:
  static constexpr std::size_t kMaxChannels = 4'096;  // senders can invent any number of channels

  void On(const LogEvent& message);

  [[nodiscard]] std::vector<ChannelLoss> losses() const;  // channels with losses, greatest loss first

 private:
  std::map<std::string, SequenceCount, std::less<>> channels_;
};

struct RecorderSettings {
  LogIdentity identity;
  std::uint64_t split_bytes = 0;  // maximum size of a log; 0: no limit
  MonoNs split_time = 0;          // maximum age of a log; 0: no limit
  std::optional<PreTrigger> pre_trigger;
};

// Composes logs from messages: header events, numbers, seals once a second and at the end, one log after the other. Does no I/O:
// time is an argument, and the records go to a LogSink.
class LogComposer {
 public:
  static constexpr MonoNs kSealInterval = kSecond;

  LogComposer(RecorderSettings settings, LogSink& output);

  // Begins the first log. With a pre-trigger, the log begins when the trigger fires.
  void Start(MonoNs now, std::int64_t utime);
  // Continues an existing log, in place of Start and without a pre-trigger. The header events are written again.
  void Continue(const LogTail& tail, MonoNs now, std::int64_t utime);

  void On(const LogEvent& message, MonoNs now);
  // Writes what is due: a seal, or the end of a log after a trigger.
  void Poll(MonoNs now, std::int64_t utime);
  [[nodiscard]] MonoNs next_poll() const;
  // Completes the log.
  void End(std::int64_t utime);

  [[nodiscard]] bool recording() const { return recording_; }  // false: it waits for the trigger
  [[nodiscard]] std::int64_t messages() const {
    return messages_;
  }                                                            // that were written, without header events and seals
  [[nodiscard]] std::int64_t bytes() const { return bytes_; }  // of all logs
  [[nodiscard]] std::int64_t early() const { return ring_ ? ring_->early() : 0; }  // MessageRing
  [[nodiscard]] const ChannelLosses& channels() const { return channels_; }

 private:
  void BeginLog(MonoNs now, std::int64_t utime, const LogTail& tail);
  void EndLog(std::int64_t utime);
  void Fire(MonoNs now, std::int64_t utime);
  void Record(const LogEvent& message, MonoNs now);
  [[nodiscard]] bool MustSplit(const LogEvent& message, MonoNs now) const;
  void Write(Bytes record);

  RecorderSettings settings_;
  LogSink& output_;
  LogEncoder encoder_;
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
