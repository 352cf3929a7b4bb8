#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "drivers/runtime/core/instant.h"
#include "drivers/runtime/core/sender_address.h"
#include "tools/udpm/udpm_packet.h"

namespace axlecast {

// Puts fragments together, in whatever order they come, in bounded memory: beyond kMemory bytes the oldest message is
// given up, and one that is not whole after kAge. Fragments that contradict each other never make a message.
class FragmentStore {
 public:
  static constexpr std::size_t kMemory = 64U << 20;  // also the largest message
  static constexpr MonoNs kAge = 2 * kSecond;

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
  };
  using Partials = std::map<Key, Partial>;

  Partials::iterator Find(const Key& key, const FragmentPacket& packet, MonoNs now);
  [[nodiscard]] static bool Contradicts(const Partial& partial, const FragmentPacket& packet);
  void GiveUp(Partials::iterator partial);
  [[nodiscard]] static std::optional<Message> Join(Partial& partial);

  Partials partials_;
  std::list<Key> oldest_first_;
  std::size_t memory_ = 0;
};

}  // namespace axlecast
