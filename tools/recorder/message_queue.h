#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// A message on its way into a log.
struct LoggedMessage {
  std::int64_t utime = 0;  // us, UNIX time of its reception
  std::string_view channel;
  Bytes data;
};

// Messages in the order in which they were added, in one block of memory.
class MessageBatch {
 public:
  void Add(const LoggedMessage& message);
  // The next one, which lives in the batch; nothing at its end.
  [[nodiscard]] std::optional<LoggedMessage> Next();
  [[nodiscard]] std::int64_t left() const { return left_; }  // messages that Next has not given
  [[nodiscard]] std::size_t bytes() const { return bytes_.size(); }
  void Clear();

 private:
  struct Head {
    std::int64_t utime;
    std::uint32_t channel_size;
    std::uint32_t data_size;
  };

  std::vector<std::uint8_t> bytes_;
  std::size_t position_ = 0;
  std::int64_t left_ = 0;
};

// From one thread that must not wait to one that may: bounded, and what does not fit is the caller's to count.
class MessageQueue {
 public:
  explicit MessageQueue(std::size_t limit);  // bytes; about twice as much memory is used at most

  // False when it is full.
  [[nodiscard]] bool Add(const LoggedMessage& message);
  // Nothing more is added.
  void Close();

  // Puts all that waits into `batch`, whose memory is used for what comes next. False when the queue is closed and
  // empty.
  [[nodiscard]] bool Take(MessageBatch& batch);
  // Readable when there is something to Take.
  [[nodiscard]] int FileDescriptor() const { return event_.FileDescriptor(); }

 private:
  std::size_t limit_;
  WakeEvent event_;
  std::mutex mutex_;
  MessageBatch waiting_;
  bool closed_ = false;
};

}  // namespace axlecast
