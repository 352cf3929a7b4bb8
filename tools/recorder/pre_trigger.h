#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/time.h"
#include "tools/recorder/message_queue.h"

namespace axlecast {

// Says when something happens that a recording is about. An alarm triggers when it appears, if the expression is found
// in "<channel> <alarm's name>", e.g. "ALARM/axis1 battery_error"; one that had appeared before the watch began does not.
// A message of any other type triggers, each time, if the expression is found in its channel's name.
class TriggerWatch {
 public:
  // `utime`: when the watch begins (us, UNIX time).
  TriggerWatch(std::regex trigger, std::int64_t utime) : trigger_(std::move(trigger)), began_(utime) {}

  [[nodiscard]] bool Fires(const LoggedMessage& message);
  [[nodiscard]] std::size_t remembered() const;  // names of alarms, over all channels

 private:
  std::regex trigger_;
  std::int64_t began_;
  std::map<std::string, std::set<std::string>, std::less<>> standing_;  // alarms of each channel
};

// The messages of the last seconds, in bounded memory: beyond it the oldest go early.
class MessageRing {
 public:
  MessageRing(MonoNs span, std::size_t limit) : span_(span), limit_(limit) {}

  void Add(const LoggedMessage& message, MonoNs now);
  // Lets go what is older than the span.
  void Expire(MonoNs now);
  // The oldest, which lives until the next call; nothing when the ring is empty.
  [[nodiscard]] bool Take(LoggedMessage& message);
  // Messages that went before their time for want of memory.
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
