#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

#include "drivers/runtime/core/timebase.h"
#include "tools/udpm/udpm_packet.h"

namespace axlecast {

// A sender's address: what the kernel says of the datagram.
struct SenderAddress {
  std::uint32_t address = 0;  // IPv4, host order
  std::uint16_t port = 0;
  auto operator<=>(const SenderAddress&) const = default;
};

// A datagram as it came.
struct Datagram {
  SenderAddress sender;
  std::int64_t utime = 0;  // us, UNIX time of the kernel's reception
  MonoNs now = 0;          // when it was read
  Bytes bytes;
};

// A whole message.
struct ReceivedMessage {
  SenderAddress sender;
  std::int64_t utime = 0;  // of its (first) datagram
  std::string_view channel;
  Bytes data;
};

struct SenderCount {
  SenderAddress sender;
  std::int64_t received = 0;  // messages
  std::int64_t lost = 0;      // by the gaps in its numbers; of late ones that came after all, taken back
  std::int64_t repeated =
      0;  // the network's copies, or numbers that ran back: a restart is not told apart from one
};

// Makes messages of datagrams, whatever their order: fragments are put together in bounded memory (`kFragmentMemory`
// bytes over all senders, the oldest given up first, incomplete ones after `kFragmentAge`), and every message that is
// missing by its sender's numbers is counted. Two numberings on one address and port (a program that was restarted on
// it) begin anew where the number falls far back. Pure: no clock, no socket.
class UdpmReceiver {
 public:
  static constexpr std::size_t kFragmentMemory = 64U << 20;
  static constexpr MonoNs kFragmentAge = 2 * kSecond;
  static constexpr std::size_t kMostSenders = 1'024;  // the one that is silent for longest is forgotten

  using Sink = std::function<void(const ReceivedMessage&)>;

  UdpmReceiver();
  ~UdpmReceiver();

  void On(const Datagram& datagram, const Sink& sink);

  [[nodiscard]] std::vector<SenderCount> senders() const;  // most lost first
  [[nodiscard]] std::int64_t received() const;             // messages
  [[nodiscard]] std::int64_t lost() const;                 // over all senders, also forgotten ones
  [[nodiscard]] std::int64_t foreign() const;              // datagrams that are none of LCM's

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace axlecast
