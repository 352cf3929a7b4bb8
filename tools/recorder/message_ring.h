#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "tools/recorder/logged_message.h"

namespace axlecast {

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
