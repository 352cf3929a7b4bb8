#include "platform/net/udpm_receiver.h"

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
  Sender& sender = Find(datagram.sender);
  fragments_.Forget(datagram.sender, packet.sequence);  // of another message with this number
  Receive(sender, packet.sequence, datagram.utime);
  sink({datagram.sender, datagram.utime, packet.channel, packet.payload});
}

void UdpmReceiver::OnPacket(const Datagram& datagram, const FragmentPacket& packet, const Sink& sink) {
  Sender& sender = Find(datagram.sender);
  const bool awaited = sender.numbers.Await(packet.sequence, datagram.utime);
  const auto message = fragments_.Add(datagram.sender, packet, datagram.now, awaited);
  if (!message) return;
  Receive(sender, packet.sequence, datagram.utime);
  sink({datagram.sender, datagram.utime, message->channel, message->data});
}

void UdpmReceiver::Receive(Sender& sender, std::uint32_t sequence, std::int64_t utime) {
  sender.numbers.Receive(sequence, utime);
  ++sender.received;
  ++received_;
  if (sender.established || sender.received < kEstablished) return;
  sender.established = true;
  established_.splice(established_.end(), strangers_, sender.place);
}

UdpmReceiver::Sender& UdpmReceiver::Find(const SenderAddress& address) {
  if (const auto known = senders_.find(address); known != senders_.end()) {
    std::list<SenderAddress>& places = known->second.established ? established_ : strangers_;
    places.splice(places.end(), places, known->second.place);
    return known->second;
  }
  if (senders_.size() >= kMaxSenders) Forget();
  Sender& sender = senders_[address];
  sender.place = strangers_.insert(strangers_.end(), address);
  return sender;
}

void UdpmReceiver::Forget() {
  std::list<SenderAddress>& places = strangers_.empty() ? established_ : strangers_;
  const auto silent = senders_.find(places.front());
  fragments_.Forget(silent->first);
  lost_of_forgotten_ += silent->second.numbers.lost();
  places.pop_front();
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
