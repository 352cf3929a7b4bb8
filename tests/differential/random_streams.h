#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace axlecast {

struct LcmMessage {
  std::string channel;
  std::string data;
  bool operator==(const LcmMessage&) const = default;
};

// One step of a sender.
struct SenderStep {
  enum class Kind { kDatagram, kLiblcm, kGroupSender };
  Kind kind = Kind::kDatagram;
  std::size_t sender = 0;  // of a datagram, below kSenders
  std::string datagram;
  LcmMessage message;  // what liblcm or GroupSender publishes
};

// What senders send, and what a receiver must make of it.
struct LcmStream {
  std::vector<SenderStep> steps;
  std::vector<LcmMessage> messages;  // in the order in which they are complete
  std::size_t fragmented = 0;        // of `messages`
  std::size_t refused = 0;           // datagrams that are not of LCM, and messages of which a fragment is missing
};

// Random streams of a few messages of several senders at once. The datagrams are made from LCM's document, "UDP Multicast Protocol
// Description", and by no code of the product.
class RandomStreams {
 public:
  static constexpr std::size_t kSenders = 6;

  explicit RandomStreams(std::uint32_t seed);
  [[nodiscard]] LcmStream Next();

 private:
  // The datagrams of one sender, and after which of them a message is complete.
  struct Track {
    std::vector<std::string> datagrams;
    std::vector<std::vector<LcmMessage>> complete;  // for each datagram
    std::size_t sent = 0;
  };

  [[nodiscard]] std::uint32_t Number() { return static_cast<std::uint32_t>(random_()); }
  [[nodiscard]] std::size_t Below(std::size_t bound) { return random_() % bound; }
  [[nodiscard]] bool OneIn(std::size_t n) { return Below(n) == 0; }
  [[nodiscard]] std::string Bytes(std::size_t size);
  [[nodiscard]] std::string Name();
  [[nodiscard]] Track MakeTrack(std::size_t sender, LcmStream& stream);
  void AddShort(Track& track, std::uint32_t sequence, LcmStream& stream);
  void AddFragments(Track& track, std::size_t sender, LcmStream& stream);
  void AddPublished(LcmStream& stream);
  [[nodiscard]] std::string Refused();

  std::mt19937 random_;
  std::vector<std::string> names_;
  std::vector<std::uint32_t> next_;  // sequence number of each sender
};

// "END" with this number: the last message of a round.
[[nodiscard]] std::string EndDatagram(std::uint32_t number);
inline constexpr const char* kEndChannel = "END";

}  // namespace axlecast
