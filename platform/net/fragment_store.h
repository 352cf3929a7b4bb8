#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/messages/lcm_url.h"
#include "platform/net/udpm_packet.h"

namespace axlecast {

// The memory that incomplete messages may take, in bytes. LCM's senders send the fragments of one message after those of
// the other, so only the newest message of a sender may be long.
struct FragmentLimits {
  std::size_t total = 64U << 20;  // of all; also the longest message. Beyond it the largest message is given up
  std::size_t older = 1U << 20;   // of those that are not their sender's newest; beyond it the oldest is given up
};

// Puts fragments together, in whatever order they come, in bounded memory. A message that is not whole after kAge is given
// up. Fragments that contradict each other never make a message.
class FragmentStore {
 public:
  static constexpr MonoNs kAge = 2 * kSecond;

  explicit FragmentStore(const FragmentLimits& limits = {}) : limits_(limits) {}

  struct Message {
    std::string channel;
    std::vector<std::uint8_t> data;
  };

  // `awaited`: the message counts as lost until it is whole. The message that `packet` completes.
  std::optional<Message> Add(const SenderAddress& sender, const FragmentPacket& packet, MonoNs now, bool awaited);
  void Expire(MonoNs now);
  void Forget(const SenderAddress& sender);
  void Forget(const SenderAddress& sender, std::uint32_t sequence);
  void Clear();

  // Awaited messages that are incomplete: of all senders, of one.
  [[nodiscard]] std::int64_t awaited() const;
  [[nodiscard]] std::int64_t awaited(const SenderAddress& sender) const;
  [[nodiscard]] std::size_t memory() const { return memory_; }  // bytes, about

 private:
  struct Key {
    SenderAddress sender;
    std::uint32_t sequence = 0;
    auto operator<=>(const Key&) const = default;
  };
  struct Piece {
    std::uint32_t offset = 0;
    std::vector<std::uint8_t> bytes;
  };
  struct Partial {
    std::uint32_t size = 0;
    std::uint16_t count = 0;
    bool awaited = false;
    MonoNs started = 0;
    std::size_t memory = 0;
    std::string channel;
    std::map<std::uint16_t, Piece> pieces;
    std::list<Key>::iterator age;
    std::optional<std::list<Key>::iterator> older;  // its place in older_; nothing: it is its sender's newest
  };
  using Partials = std::map<Key, Partial>;

  Partials::iterator Find(const Key& key, const FragmentPacket& packet, MonoNs now);
  [[nodiscard]] static bool Contradicts(const Partial& partial, const FragmentPacket& packet);
  void GiveUp(Partials::iterator partial);
  void MakeRoom();
  // Makes it its sender's newest message, unless a newer one is incomplete.
  void Rank(Partials::iterator partial);
  void MoveToOlder(Partials::iterator partial);
  void Grow(Partial& partial, std::size_t bytes);
  [[nodiscard]] static std::optional<Message> Join(Partial& partial);

  const FragmentLimits limits_;
  Partials partials_;
  std::map<SenderAddress, Partials::iterator> newest_;  // of each sender
  std::list<Key> oldest_first_;
  std::list<Key> older_;  // all others, oldest first
  std::size_t memory_ = 0;
  std::size_t older_memory_ = 0;
};

}  // namespace axlecast
