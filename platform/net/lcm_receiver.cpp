#include "platform/net/lcm_receiver.h"

namespace axlecast {
namespace {

constexpr MonoNs kCountDrops = 100 * kMillisecond;
constexpr std::string_view kSelfTest = "LCM_SELF_TEST";  // every process that uses liblcm sends itself one

}  // namespace

LcmReceiver::LcmReceiver(const LcmUrl& url) : port_(url), receiver_(kFragments) {}

std::size_t LcmReceiver::Read(const Sink& sink) {
  const auto batch = port_.Read();
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
  malformed_ = receiver_.foreign() - port_.outside();
  if (now < next_count_) return;
  next_count_ = now + kCountDrops;
  dropped_ = port_.Dropped();
}

ReceptionCounts LcmReceiver::counts() const {
  return {.messages = messages_, .dropped = dropped_, .outside = outside_, .malformed = malformed_};
}

}  // namespace axlecast
