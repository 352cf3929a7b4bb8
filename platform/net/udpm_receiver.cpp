#include "platform/net/udpm_receiver.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace axlecast {

std::int64_t MessageNumbers::Behind(std::uint32_t number) const {
  return static_cast<std::int32_t>(next_ - number);
}

bool MessageNumbers::Came(std::uint32_t number) const {
  const std::uint32_t slot = number % kRemembered;
  return (came_[slot / 64] >> (slot % 64) & 1) != 0;
}

void MessageNumbers::Mark(std::uint32_t number, bool came) {
  const std::uint32_t slot = number % kRemembered;
  const std::uint64_t bit = std::uint64_t{1} << (slot % 64);
  came_[slot / 64] = came ? came_[slot / 64] | bit : came_[slot / 64] & ~bit;
}

void MessageNumbers::Begin(std::uint32_t number) {
  started_ = true;
  next_ = number;
  span_ = 0;
}

void MessageNumbers::Advance(std::int64_t ahead) {
  lost_ += ahead;
  span_ = std::min(span_ + ahead, kRemembered);
  next_ += static_cast<std::uint32_t>(ahead);
  for (std::int64_t i = 1; i <= std::min(ahead, kRemembered); ++i)
    Mark(next_ - static_cast<std::uint32_t>(i), false);
}

// Makes `number` one of the stored numbers, or one before the begin.
void MessageNumbers::Place(std::uint32_t number, std::int64_t utime) {
  const std::int64_t behind = Behind(number);
  const bool restarted = number == 0 && behind > 0 && utime - last_utime_ >= kSilenceUs;
  if (!started_ || restarted || behind > span_ + kStragglers || behind <= -kFarthestAhead) Begin(number);
  last_utime_ = utime;
  if (const std::int64_t now_behind = Behind(number); now_behind <= 0) Advance(1 - now_behind);
}

void MessageNumbers::Receive(std::uint32_t number, std::int64_t utime) {
  Place(number, utime);
  if (Behind(number) > span_) return;
  if (Came(number)) {
    ++repeated_;
    return;
  }
  --lost_;
  Mark(number, true);
}

bool MessageNumbers::Await(std::uint32_t number, std::int64_t utime) {
  Place(number, utime);
  return Behind(number) <= span_ && !Came(number);
}

namespace {

std::uint32_t Read16(Bytes bytes, std::size_t at) {
  return static_cast<std::uint32_t>(bytes[at]) << 8 | bytes[at + 1];
}

std::uint32_t Read32(Bytes bytes, std::size_t at) { return Read16(bytes, at) << 16 | Read16(bytes, at + 2); }

// Removes the channel and its NUL from the front.
std::optional<std::string_view> TakeChannel(Bytes& rest) {
  const auto end = std::find(rest.begin(), rest.end(), std::uint8_t{0});
  const auto size = static_cast<std::size_t>(end - rest.begin());
  if (end == rest.end() || size == 0 || size > kLongestChannel) return std::nullopt;
  const std::string_view channel(reinterpret_cast<const char*>(rest.data()), size);
  rest = rest.subspan(size + 1);
  return channel;
}

std::optional<UdpmPacket> ParseShort(Bytes datagram) {
  ShortPacket packet;
  packet.sequence = Read32(datagram, 4);
  packet.payload = datagram.subspan(kShortHeader);
  const auto channel = TakeChannel(packet.payload);
  if (!channel) return std::nullopt;
  packet.channel = *channel;
  return packet;
}

// Every fragment except the first has bytes, and no fragment exceeds the message.
bool IsConsistent(const FragmentPacket& packet) {
  if (packet.number >= packet.count || packet.size > kLargestMessage || packet.offset > packet.size) return false;
  if (packet.payload.size() > packet.size - packet.offset) return false;
  if (packet.number == 0) {
    return packet.offset == 0 && (packet.count == 1) == (packet.payload.size() == packet.size);
  }
  return !packet.payload.empty() && packet.count - std::uint64_t{1} <= packet.size;
}

std::optional<UdpmPacket> ParseFragment(Bytes datagram) {
  if (datagram.size() < kFragmentHeader) return std::nullopt;
  FragmentPacket packet;
  packet.sequence = Read32(datagram, 4);
  packet.size = Read32(datagram, 8);
  packet.offset = Read32(datagram, 12);
  packet.number = static_cast<std::uint16_t>(Read16(datagram, 16));
  packet.count = static_cast<std::uint16_t>(Read16(datagram, 18));
  packet.payload = datagram.subspan(kFragmentHeader);
  if (packet.number == 0) {
    const auto channel = TakeChannel(packet.payload);
    if (!channel) return std::nullopt;
    packet.channel = *channel;
  }
  if (!IsConsistent(packet)) return std::nullopt;
  return packet;
}

constexpr std::size_t kPieceCost = 128;    // bytes in addition to its content: a node, an allocation
constexpr std::size_t kPartialCost = 384;  // two nodes

}  // namespace

std::optional<UdpmPacket> ParseUdpm(Bytes datagram) {
  if (datagram.size() < kShortHeader) return std::nullopt;
  switch (Read32(datagram, 0)) {
    case kShortMagic:
      return ParseShort(datagram);
    case kFragmentMagic:
      return ParseFragment(datagram);
    default:
      return std::nullopt;
  }
}

std::optional<FragmentStore::Message> FragmentStore::Add(const SenderAddress& sender, const FragmentPacket& packet,
                                                         MonoNs now, bool awaited) {
  Expire(now);
  if (packet.size > limits_.total) return std::nullopt;
  const Key key{sender, packet.sequence};
  const auto found = Find(key, packet, now);
  Partial& partial = found->second;
  partial.awaited = awaited;
  const auto [piece, fresh] = partial.pieces.try_emplace(packet.number);
  if (!fresh) return std::nullopt;
  piece->second = {packet.offset, {packet.payload.begin(), packet.payload.end()}};
  if (packet.number == 0) partial.channel = packet.channel;
  Grow(partial, kPieceCost + packet.payload.size());
  std::optional<Message> whole;
  if (partial.pieces.size() == partial.count) {
    whole = Join(partial);
    Drop(found);
  }
  MakeRoom();
  return whole;
}

void FragmentStore::Grow(Partial& partial, std::size_t bytes) {
  partial.memory += bytes;
  memory_ += bytes;
  if (partial.older) older_memory_ += bytes;
}

void FragmentStore::MakeRoom() {
  while (older_memory_ > limits_.older) Drop(partials_.find(older_.front()));
  while (memory_ > limits_.total) {
    const auto largest = std::max_element(newest_.begin(), newest_.end(), [](const auto& one, const auto& other) {
      return one.second->second.memory < other.second->second.memory;
    });
    Drop(largest != newest_.end() ? largest->second : partials_.find(older_.front()));
  }
}

void FragmentStore::Rank(Partials::iterator partial) {
  const auto [newest, first] = newest_.try_emplace(partial->first.sender, partial);
  if (first) return;
  const auto ahead = static_cast<std::int32_t>(partial->first.sequence - newest->second->first.sequence);
  if (ahead < 0) return MoveToOlder(partial);
  MoveToOlder(newest->second);
  newest->second = partial;
}

void FragmentStore::MoveToOlder(Partials::iterator partial) {
  partial->second.older = older_.insert(older_.end(), partial->first);
  older_memory_ += partial->second.memory;
}

FragmentStore::Partials::iterator FragmentStore::Find(const Key& key, const FragmentPacket& packet, MonoNs now) {
  auto found = partials_.find(key);
  if (found != partials_.end() && Contradicts(found->second, packet)) {
    Drop(found);
    found = partials_.end();
  }
  if (found != partials_.end()) return found;
  Partial partial;
  partial.size = packet.size;
  partial.count = packet.count;
  partial.started = now;
  partial.age = oldest_first_.insert(oldest_first_.end(), key);
  found = partials_.emplace(key, std::move(partial)).first;
  Rank(found);
  Grow(found->second, kPartialCost);
  return found;
}

bool FragmentStore::Contradicts(const Partial& partial, const FragmentPacket& packet) {
  if (partial.size != packet.size || partial.count != packet.count) return true;
  const auto same = partial.pieces.find(packet.number);
  if (same == partial.pieces.end()) return false;
  const Piece& piece = same->second;
  return piece.offset != packet.offset ||
         !std::equal(piece.bytes.begin(), piece.bytes.end(), packet.payload.begin(), packet.payload.end());
}

// Joins pieces without gaps or overlaps that have the announced size.
std::optional<FragmentStore::Message> FragmentStore::Join(Partial& partial) {
  Message message{std::move(partial.channel), {}};
  message.data.reserve(partial.size);
  for (const auto& [number, piece] : partial.pieces) {
    if (piece.offset != message.data.size()) return std::nullopt;
    message.data.insert(message.data.end(), piece.bytes.begin(), piece.bytes.end());
  }
  if (message.data.size() != partial.size) return std::nullopt;
  return message;
}

void FragmentStore::Drop(Partials::iterator partial) {
  memory_ -= partial->second.memory;
  oldest_first_.erase(partial->second.age);
  if (partial->second.older) {
    older_memory_ -= partial->second.memory;
    older_.erase(*partial->second.older);
  } else {
    newest_.erase(partial->first.sender);
  }
  partials_.erase(partial);
}

void FragmentStore::Expire(MonoNs now) {
  while (!oldest_first_.empty()) {
    const auto oldest = partials_.find(oldest_first_.front());
    if (now - oldest->second.started <= kAge) return;
    Drop(oldest);
  }
}

void FragmentStore::Forget(const SenderAddress& sender) {
  auto partial = partials_.lower_bound({sender, 0});
  while (partial != partials_.end() && partial->first.sender == sender) Drop(partial++);
}

void FragmentStore::Forget(const SenderAddress& sender, std::uint32_t sequence) {
  if (partials_.empty()) return;
  const auto partial = partials_.find({sender, sequence});
  if (partial != partials_.end()) Drop(partial);
}

void FragmentStore::Clear() {
  partials_.clear();
  newest_.clear();
  oldest_first_.clear();
  older_.clear();
  memory_ = 0;
  older_memory_ = 0;
}

std::int64_t FragmentStore::awaited() const {
  return std::count_if(partials_.begin(), partials_.end(), [](const auto& entry) { return entry.second.awaited; });
}

std::int64_t FragmentStore::awaited(const SenderAddress& sender) const {
  std::int64_t count = 0;
  for (auto partial = partials_.lower_bound({sender, 0});
       partial != partials_.end() && partial->first.sender == sender; ++partial) {
    if (partial->second.awaited) ++count;
  }
  return count;
}

void UdpmReceiver::On(const Datagram& datagram, const Sink& sink) {
  const std::optional<UdpmPacket> packet = ParseUdpm(datagram.bytes);
  if (!packet) {
    ++malformed_;
    return;
  }
  std::visit([&](const auto& kind) { OnPacket(datagram, kind, sink); }, *packet);
}

void UdpmReceiver::OnPacket(const Datagram& datagram, const ShortPacket& packet, const Sink& sink) {
  Sender& sender = Find(datagram.sender);
  fragments_.Forget(datagram.sender, packet.sequence);  // fragments of another message with this number
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
  lost_of_removed_ += silent->second.numbers.lost();
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
  std::sort(counts.begin(), counts.end(), [](const SenderCount& one, const SenderCount& other) {
    return std::tie(other.lost, one.sender) < std::tie(one.lost, other.sender);
  });
  return counts;
}

std::int64_t UdpmReceiver::lost() const {
  std::int64_t lost = lost_of_removed_ - fragments_.awaited();
  for (const auto& [address, sender] : senders_) lost += sender.numbers.lost();
  return lost;
}

}  // namespace axlecast
