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

#include "core/base/time.h"
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

}  // namespace axlecast
