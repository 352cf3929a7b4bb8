#pragma once

#include <array>
#include <cstdint>

namespace axlecast {

// The numbers of one sender's messages: which came, and how many are missing. They wrap around at 2^32.
//
// What it starts with counts as the beginning: what was sent before is not missed. A number within the newest
// kRemembered that is behind the newest is late where it was missing (no longer lost), else repeated. Numbers that fall
// further back or jump further ahead begin a new numbering, and so does 0 after a silence: LCM's senders start there.
class MessageNumbers {
 public:
  static constexpr std::int64_t kRemembered = 4'096;
  static constexpr std::int64_t kFarthestAhead = std::int64_t{1} << 24;  // messages lost at a stretch
  static constexpr std::int64_t kSilenceUs = 50'000;  // a network's copy comes sooner, a new program later

  // A message came, at `utime` (us, UNIX).
  void Receive(std::uint32_t number, std::int64_t utime);

  // A part of it came: it was sent, and is lost unless Receive follows. False when it was received before.
  bool Await(std::uint32_t number, std::int64_t utime);

  [[nodiscard]] std::int64_t lost() const { return lost_; }
  [[nodiscard]] std::int64_t repeated() const { return repeated_; }

 private:
  static constexpr std::int64_t kStragglers = 64;  // late ones of before the beginning

  void Place(std::uint32_t number, std::int64_t utime);
  void Begin(std::uint32_t number);
  void Advance(std::int64_t ahead);
  // Returns how far `number` is behind the next number; 0 or less: it is new.
  [[nodiscard]] std::int64_t Behind(std::uint32_t number) const;
  [[nodiscard]] bool Came(std::uint32_t number) const;
  void Mark(std::uint32_t number, bool came);

  bool started_ = false;
  std::uint32_t next_ = 0;
  std::int64_t span_ = 0;  // numbers behind next_ that are remembered
  std::int64_t heard_ = 0;
  std::int64_t lost_ = 0;
  std::int64_t repeated_ = 0;
  std::array<std::uint64_t, kRemembered / 64> came_{};
};

}  // namespace axlecast
