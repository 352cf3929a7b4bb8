#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <variant>
#include <vector>

#include "core/base/inline_bytes.h"
#include "core/base/time.h"
#include "core/messages/lcm_url.h"

namespace axlecast {

// The numbers of the messages of one sender: which were received, and how many are missing. They wrap around at 2^32.
//
// The first number is the begin; earlier messages are not missing. A number among the newest kRemembered is late if it was
// missing (it is not lost any more), and otherwise repeated. A number further back, a larger jump ahead, and 0 after a silence
// begin a new numbering, because senders of LCM start at 0.
class MessageNumbers {
 public:
  static constexpr std::int64_t kRemembered = 4'096;
  static constexpr std::int64_t kFarthestAhead = std::int64_t{1} << 24;  // consecutive lost messages
  static constexpr std::int64_t kSilenceUs = 50'000;  // a copy by the network comes sooner, a new program later

  // Counts a message that was received at `utime` (us, UNIX).
  void Receive(std::uint32_t number, std::int64_t utime);

  // Counts a part of a message: the message is lost unless Receive follows. Returns false if it was received before.
  bool Await(std::uint32_t number, std::int64_t utime);

  [[nodiscard]] std::int64_t lost() const { return lost_; }
  [[nodiscard]] std::int64_t repeated() const { return repeated_; }

 private:
  static constexpr std::int64_t kStragglers = 64;  // late ones from before the begin

  void Place(std::uint32_t number, std::int64_t utime);
  void Begin(std::uint32_t number);
  void Advance(std::int64_t ahead);
  // Returns how far `number` is behind the next number; 0 or less: it is new.
  [[nodiscard]] std::int64_t Behind(std::uint32_t number) const;
  [[nodiscard]] bool Came(std::uint32_t number) const;
  void Mark(std::uint32_t number, bool came);

  bool started_ = false;
  std::uint32_t next_ = 0;
  std::int64_t span_ = 0;  // stored numbers before next_
  std::int64_t last_utime_ = 0;
  std::int64_t lost_ = 0;
  std::int64_t repeated_ = 0;
  std::array<std::uint64_t, kRemembered / 64> came_{};
};

// The datagrams of the UDP multicast protocol of LCM (LCM 1.3.1 documentation, "UDP Multicast Protocol Description"),
// big-endian. Short: u32 0x4c433032, u32 sequence, channel, NUL, payload. Fragment: u32 0x4c433033, u32 sequence, u32
// payload size, u32 fragment offset, u16 fragment number, u16 fragments, then (in fragment 0) channel and NUL, then the
// fragment's payload. A sender numbers messages, not datagrams, from 0, and wraps around.
struct ShortPacket {
  std::uint32_t sequence = 0;
  std::string_view channel;
  Bytes payload;
};

struct FragmentPacket {
  std::uint32_t sequence = 0;
  std::uint32_t size = 0;    // of the whole message
  std::uint32_t offset = 0;  // of this payload in it
  std::uint16_t number = 0;  // of this fragment, from 0
  std::uint16_t count = 0;   // of fragments
  std::string_view channel;  // in fragment 0 only
  Bytes payload;
};

using UdpmPacket = std::variant<ShortPacket, FragmentPacket>;

inline constexpr std::uint32_t kShortMagic = 0x4c433032;     // "LC02"
inline constexpr std::uint32_t kFragmentMagic = 0x4c433033;  // "LC03"
inline constexpr std::size_t kShortHeader = 8;
inline constexpr std::size_t kFragmentHeader = 20;
inline constexpr std::size_t kLongestChannel = 63;        // without the NUL; lcm_udpm.c
inline constexpr std::size_t kLargestMessage = 1U << 28;  // bytes; LCM's own limit (lcm_udpm.c)

// Parses a datagram; the views point into `datagram`. Returns nothing if it is not LCM's, is truncated, names no channel
// (no event log can hold such a message), or contradicts itself.
[[nodiscard]] std::optional<UdpmPacket> ParseUdpm(Bytes datagram);

// The memory limits of incomplete messages, in bytes. A sender sends the fragments of one message after those of the other, so
// only its newest message may be long.
struct FragmentLimits {
  std::size_t total = 64U << 20;  // of all, and of the longest message. If exceeded, the largest message is dropped
  std::size_t older =
      1U << 20;  // of messages that are not the newest of their sender. If exceeded, the oldest is dropped
};

// Joins fragments in any order, in bounded memory. A message that is incomplete after kAge is dropped. Contradictory fragments
// never result in a message.
class FragmentStore {
 public:
  static constexpr MonoNs kAge = 2 * kSecond;

  explicit FragmentStore(const FragmentLimits& limits = {}) : limits_(limits) {}

  struct Message {
    std::string channel;
    std::vector<std::uint8_t> data;
  };

  // Returns the message that `packet` completes, if any. `awaited`: the message counts as lost until it is complete.
  std::optional<Message> Add(const SenderAddress& sender, const FragmentPacket& packet, MonoNs now, bool awaited);
  void Expire(MonoNs now);
  void Forget(const SenderAddress& sender);
  void Forget(const SenderAddress& sender, std::uint32_t sequence);
  void Clear();

  // Incomplete awaited messages: of all senders, of one sender.
  [[nodiscard]] std::int64_t awaited() const;
  [[nodiscard]] std::int64_t awaited(const SenderAddress& sender) const;
  [[nodiscard]] std::size_t memory() const { return memory_; }  // approximate bytes

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
    std::optional<std::list<Key>::iterator> older;  // its place in older_; nothing: it is the newest of its sender
  };
  using Partials = std::map<Key, Partial>;

  Partials::iterator Find(const Key& key, const FragmentPacket& packet, MonoNs now);
  [[nodiscard]] static bool Contradicts(const Partial& partial, const FragmentPacket& packet);
  void Drop(Partials::iterator partial);
  void MakeRoom();
  // Makes it the newest message of its sender, unless a newer one is incomplete.
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

// A received datagram.
struct Datagram {
  SenderAddress sender;
  std::int64_t utime = 0;  // us, UNIX time of the reception by the kernel
  MonoNs now = 0;          // when it was read
  Bytes bytes;
};

// A complete message.
struct ReceivedMessage {
  SenderAddress sender;
  std::int64_t utime = 0;  // of the datagram that completed it, as in LCM
  std::string_view channel;
  Bytes data;
};

struct SenderCount {
  SenderAddress sender;
  std::int64_t received = 0;  // messages
  std::int64_t lost = 0;      // by the gaps in its numbers, without late messages
  std::int64_t repeated = 0;  // copies by the network, or numbers that ran back a little
};

// Converts datagrams in any order to messages: joins fragments in bounded memory (FragmentStore), and counts the messages that
// are missing by the numbers of their sender (MessageNumbers). Passes on every complete message, also repeated ones. Has no
// clock and no socket.
class UdpmReceiver {
 public:
  // If there are more than kMaxSenders, the sender that is silent for longest is removed. Senders with fewer than kEstablished
  // messages are removed first, so that a flood from new addresses does not remove a sender of the machine.
  static constexpr std::size_t kMaxSenders = 1'024;
  static constexpr std::int64_t kEstablished = 16;

  using Sink = std::function<void(const ReceivedMessage&)>;

  explicit UdpmReceiver(const FragmentLimits& limits = {}) : fragments_(limits) {}

  void On(const Datagram& datagram, const Sink& sink);
  // Ends the reception: incomplete messages are lost.
  void End();

  [[nodiscard]] std::vector<SenderCount> senders() const;            // most lost first
  [[nodiscard]] std::int64_t received() const { return received_; }  // messages
  [[nodiscard]] std::int64_t lost() const;                           // of all senders, also removed ones
  [[nodiscard]] std::size_t fragment_memory() const { return fragments_.memory(); }  // approximate bytes
  [[nodiscard]] std::int64_t malformed() const { return malformed_; }  // datagrams that are not of LCM

 private:
  struct Sender {
    MessageNumbers numbers;
    std::int64_t received = 0;
    bool established = false;
    std::list<SenderAddress>::iterator place;  // in strangers_ or established_
  };

  Sender& Find(const SenderAddress& address);
  void Forget();
  void Receive(Sender& sender, std::uint32_t sequence, std::int64_t utime);
  void OnPacket(const Datagram& datagram, const ShortPacket& packet, const Sink& sink);
  void OnPacket(const Datagram& datagram, const FragmentPacket& packet, const Sink& sink);

  std::unordered_map<SenderAddress, Sender, SenderHash> senders_;
  std::list<SenderAddress> strangers_;    // the sender that is silent for longest is first
  std::list<SenderAddress> established_;  // likewise
  FragmentStore fragments_;
  std::int64_t received_ = 0;
  std::int64_t malformed_ = 0;
  std::int64_t lost_of_removed_ = 0;
};

}  // namespace axlecast
