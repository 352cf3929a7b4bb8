#include "tools/recorder/message_ring.h"

#include <utility>

namespace axlecast {
namespace {

constexpr std::size_t kAllocations = 32;  // bytes of bookkeeping

}  // namespace

std::size_t MessageRing::Cost(const Entry& entry) {
  return sizeof(Entry) + kAllocations + entry.channel.size() + entry.data.size();
}

void MessageRing::Add(const LoggedMessage& message, MonoNs now) {
  Entry entry{now, message.utime, std::string(message.channel), {message.data.begin(), message.data.end()}};
  bytes_ += Cost(entry);
  entries_.push_back(std::move(entry));
  Expire(now);
  while (bytes_ > limit_ && !entries_.empty()) {
    ++early_;
    Drop();
  }
}

void MessageRing::Expire(MonoNs now) {
  while (!entries_.empty() && entries_.front().at < now - span_) Drop();
}

void MessageRing::Drop() {
  bytes_ -= Cost(entries_.front());
  entries_.pop_front();
}

bool MessageRing::Take(LoggedMessage& message) {
  if (entries_.empty()) return false;
  bytes_ -= Cost(entries_.front());
  taken_ = std::move(entries_.front());
  entries_.pop_front();
  message = {taken_.utime, taken_.channel, taken_.data};
  return true;
}

}  // namespace axlecast
