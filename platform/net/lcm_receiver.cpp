#include "platform/net/lcm_receiver.h"

#include <optional>
#include <utility>

namespace axlecast {
namespace {

constexpr MonoNs kCountDrops = 100 * kMillisecond;
constexpr std::string_view kSelfTest = "LCM_SELF_TEST";  // every process that uses liblcm sends itself one

}  // namespace

bool ChannelSubscriptions::Add(const std::string& pattern, Handler handler) {
  std::optional<ChannelPattern> channels = ChannelPattern::Of(pattern);
  if (!channels) return false;
  subscriptions_.push_back({*std::move(channels), std::move(handler)});
  remembered_.assign(kRememberedNames, {});
  return true;
}

std::size_t ChannelSubscriptions::Dispatch(std::string_view channel, Bytes message) {
  if (subscriptions_.empty()) return 0;
  const Remembered& remembered = Find(channel);
  for (const std::uint16_t index : remembered.matching) subscriptions_[index].handler(remembered.name, message);
  return remembered.matching.size();
}

const ChannelSubscriptions::Remembered& ChannelSubscriptions::Find(std::string_view channel) {
  Remembered& place = remembered_[std::hash<std::string_view>()(channel) % kRememberedNames];
  if (place.channel == channel && !channel.empty()) return place;
  place.channel = channel;
  place.matching.clear();
  if (!channel.starts_with(prefix_)) return place;
  place.name = channel.substr(prefix_.size());
  for (std::size_t i = 0; i < subscriptions_.size(); ++i) {
    if (subscriptions_[i].pattern.Matches(place.name)) place.matching.push_back(static_cast<std::uint16_t>(i));
  }
  return place;
}

std::size_t ChannelSubscriptions::memory() const {
  std::size_t bytes = remembered_.capacity() * sizeof(Remembered);
  for (const Remembered& place : remembered_) {
    bytes += place.channel.capacity() + place.name.capacity() + place.matching.capacity() * sizeof(std::uint16_t);
  }
  return bytes;
}

LcmReceiver::LcmReceiver(const LcmUrl& url)
    : port_(url), receiver_(kFragments), network_(port_.network_problem()) {}

std::size_t LcmReceiver::Read(const Sink& sink) {
  const auto batch = port_.Read();
  if (port_.network_problem() != network_) {  // which only this thread writes
    const std::scoped_lock lock(mutex_);
    network_ = port_.network_problem();
  }
  const MonoNs now = clock_.Now();
  for (const MulticastPort::Received& datagram : batch) {
    receiver_.On({datagram.sender, datagram.utime, now, datagram.bytes}, [&sink](const ReceivedMessage& message) {
      if (message.channel != kSelfTest) sink(message.channel, message.data);
    });
  }
  if (now >= next_count_ || !batch.empty()) Count(now);
  return batch.size();
}

void LcmReceiver::Count(MonoNs now) {
  messages_ = receiver_.received();
  outside_ = port_.outside();
  malformed_ = receiver_.malformed() - port_.outside();
  if (now < next_count_) return;
  next_count_ = now + kCountDrops;
  dropped_ = port_.Dropped();
}

ReceptionCounts LcmReceiver::counts() const {
  const std::scoped_lock lock(mutex_);
  return {.messages = messages_,
          .dropped = dropped_,
          .outside = outside_,
          .malformed = malformed_,
          .machines = {},
          .network = network_};
}

}  // namespace axlecast
