#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "platform/os/descriptor.h"
#include "tools/log/log_event.h"

namespace axlecast {

// Messages in the order in which they were added, in one block of memory.
class MessageBatch {
 public:
  void Add(const LogEvent& message);
  // Returns the next message, or nothing at the end. Its views refer to the batch.
  [[nodiscard]] std::optional<LogEvent> Next();
  [[nodiscard]] std::int64_t left() const { return left_; }  // messages that Next has not returned yet
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

// Passes messages from a thread that must not wait to a thread that may wait. Its size is limited; the caller counts the messages
// that find no space.
class MessageQueue {
 public:
  explicit MessageQueue(std::size_t limit);  // bytes; uses at most about twice this memory

  // Returns false if the queue is full.
  [[nodiscard]] bool Add(const LogEvent& message);
  // Ends the queue: Take returns false once it is empty.
  void Close();

  // Moves all waiting messages into `batch`, and reuses the memory of `batch`. Returns false if the queue is closed and empty.
  [[nodiscard]] bool Take(MessageBatch& batch);
  // Readable while Take has something to return.
  [[nodiscard]] int FileDescriptor() const { return event_.FileDescriptor(); }

 private:
  std::size_t limit_;
  WakeEvent event_;
  std::mutex mutex_;
  MessageBatch waiting_;
  bool closed_ = false;
};

}  // namespace axlecast
