#include "tools/recorder/message_queue.h"

#include <cstring>
#include <utility>

namespace axlecast {

void MessageBatch::Add(const LogEvent& message) {
  const Head head{message.utime, static_cast<std::uint32_t>(message.channel.size()),
                  static_cast<std::uint32_t>(message.data.size())};
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&head);
  bytes_.insert(bytes_.end(), bytes, bytes + sizeof head);
  bytes_.insert(bytes_.end(), message.channel.begin(), message.channel.end());
  bytes_.insert(bytes_.end(), message.data.begin(), message.data.end());
  ++left_;
}

std::optional<LogEvent> MessageBatch::Next() {
  if (left_ == 0) return std::nullopt;
  Head head;
  std::memcpy(&head, bytes_.data() + position_, sizeof head);
  const std::uint8_t* channel = bytes_.data() + position_ + sizeof head;
  position_ += sizeof head + head.channel_size + head.data_size;
  --left_;
  return LogEvent{.utime = head.utime,
                  .channel = AsText({channel, head.channel_size}),
                  .data = Bytes(channel + head.channel_size, head.data_size)};
}

void MessageBatch::Clear() {
  bytes_.clear();
  position_ = 0;
  left_ = 0;
}

MessageQueue::MessageQueue(std::size_t limit) : limit_(limit) {}

bool MessageQueue::Add(const LogEvent& message) {
  bool was_empty = false;
  {
    const std::scoped_lock lock(mutex_);
    if (waiting_.bytes() + message.channel.size() + message.data.size() > limit_) return false;
    was_empty = waiting_.left() == 0;
    waiting_.Add(message);
  }
  if (was_empty) event_.Set();
  return true;
}

void MessageQueue::Close() {
  {
    const std::scoped_lock lock(mutex_);
    closed_ = true;
  }
  event_.Set();
}

bool MessageQueue::Take(MessageBatch& batch) {
  event_.Take();
  batch.Clear();
  const std::scoped_lock lock(mutex_);
  std::swap(batch, waiting_);
  if (closed_) event_.Set();  // the end must wake the reader as well
  return batch.left() > 0 || !closed_;
}

}  // namespace axlecast
