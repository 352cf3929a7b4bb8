#include "platform/net/fragment_store.h"

#include <algorithm>
#include <utility>

namespace axlecast {
namespace {

constexpr std::size_t kPieceCost = 128;    // bytes beside its content: a node, an allocation
constexpr std::size_t kPartialCost = 384;  // two nodes

}  // namespace

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
    GiveUp(found);
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
  while (older_memory_ > limits_.older) GiveUp(partials_.find(older_.front()));
  while (memory_ > limits_.total) {
    const auto largest = std::max_element(newest_.begin(), newest_.end(), [](const auto& one, const auto& other) {
      return one.second->second.memory < other.second->second.memory;
    });
    GiveUp(largest != newest_.end() ? largest->second : partials_.find(older_.front()));
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
    GiveUp(found);
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

// Pieces that follow each other without a gap or an overlap, and are as long as announced.
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

void FragmentStore::GiveUp(Partials::iterator partial) {
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
    GiveUp(oldest);
  }
}

void FragmentStore::Forget(const SenderAddress& sender) {
  auto partial = partials_.lower_bound({sender, 0});
  while (partial != partials_.end() && partial->first.sender == sender) GiveUp(partial++);
}

void FragmentStore::Forget(const SenderAddress& sender, std::uint32_t sequence) {
  if (partials_.empty()) return;
  const auto partial = partials_.find({sender, sequence});
  if (partial != partials_.end()) GiveUp(partial);
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

}  // namespace axlecast
