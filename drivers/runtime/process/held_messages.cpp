#include "drivers/runtime/process/held_messages.h"

#include <span>

namespace axlecast {
namespace {

constexpr std::size_t kLongestChannel = 200;

}  // namespace

HeldMessages::HeldMessages(MessageSink& sink) : sink_(sink) {
  for (Held& held : held_) {
    held.channel.reserve(kLongestChannel);
    held.message.reserve(kMaxMessage);
  }
}

void HeldMessages::Publish(const std::string& channel, Bytes message) {
  if (count_ == held_.size()) SendAll();
  Held& held = held_[count_++];
  held.channel.assign(channel);
  held.message.assign(message.begin(), message.end());
}

void HeldMessages::SendAll() {
  for (const Held& held : std::span(held_).first(count_)) sink_.Publish(held.channel, held.message);
  count_ = 0;
}

}  // namespace axlecast
