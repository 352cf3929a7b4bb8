#include "tools/udpm/udpm_receiver.h"

#include <algorithm>
#include <optional>
#include <variant>

namespace axlecast {

void UdpmReceiver::On(const Datagram& datagram, const Sink& sink) {
  const std::optional<UdpmPacket> packet = ParseUdpm(datagram.bytes);
  if (!packet) {
    ++foreign_;
    return;
  }
  std::visit([&](const auto& kind) { OnPacket(datagram, kind, sink); }, *packet);
}

void UdpmReceiver::OnPacket(const Datagram& datagram, const ShortPacket& packet, const Sink& sink) {
  Sender& sender = Find(datagram);
  fragments_.Forget(datagram.sender, packet.sequence);  // of another message with this number
  sender.numbers.Receive(packet.sequence, datagram.utime);
  ++sender.received;
  ++received_;
  sink({datagram.sender, datagram.utime, packet.channel, packet.payload});
}

void UdpmReceiver::OnPacket(const Datagram& datagram, const FragmentPacket& packet, const Sink& sink) {
  Sender& sender = Find(datagram);
  const bool awaited = sender.numbers.Await(packet.sequence, datagram.utime);
  const auto message = fragments_.Add(datagram.sender, packet, datagram.now, awaited);
  if (!message) return;
  sender.numbers.Receive(packet.sequence, datagram.utime);
  ++sender.received;
  ++received_;
  sink({datagram.sender, datagram.utime, message->channel, message->data});
}

UdpmReceiver::Sender& UdpmReceiver::Find(const Datagram& datagram) {
  if (senders_.size() >= kMostSenders && !senders_.contains(datagram.sender)) Forget();
  Sender& sender = senders_[datagram.sender];
  sender.heard = datagram.now;
  return sender;
}

void UdpmReceiver::Forget() {
  const auto silent = std::min_element(senders_.begin(), senders_.end(), [](const auto& one, const auto& other) {
    return one.second.heard < other.second.heard;
  });
  fragments_.Forget(silent->first);
  lost_of_forgotten_ += silent->second.numbers.lost();
  senders_.erase(silent);
}

void UdpmReceiver::End() { fragments_.Clear(); }

std::vector<SenderCount> UdpmReceiver::senders() const {
  std::vector<SenderCount> counts;
  for (const auto& [address, sender] : senders_) {
    counts.push_back(
        {address, sender.received, sender.numbers.lost() - fragments_.awaited(address), sender.numbers.repeated()});
  }
  std::stable_sort(counts.begin(), counts.end(),
                   [](const SenderCount& one, const SenderCount& other) { return one.lost > other.lost; });
  return counts;
}

std::int64_t UdpmReceiver::lost() const {
  std::int64_t lost = lost_of_forgotten_ - fragments_.awaited();
  for (const auto& [address, sender] : senders_) lost += sender.numbers.lost();
  return lost;
}

}  // namespace axlecast
