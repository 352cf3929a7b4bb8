#pragma once

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <string_view>
#include <vector>

#include "core/messages/lcm_url.h"
#include "platform/net/fragment_store.h"
#include "platform/net/message_numbers.h"

namespace axlecast {

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
  std::int64_t utime = 0;  // of the datagram that completed it, as in LCM
  std::string_view channel;
  Bytes data;
};

struct SenderCount {
  SenderAddress sender;
  std::int64_t received = 0;  // messages
  std::int64_t lost = 0;      // by the gaps in its numbers; late ones that came after all are taken back
  std::int64_t repeated = 0;  // the network's copies, or numbers that ran back a little
};

// Makes messages of datagrams, whatever their order: fragments are put together in bounded memory (FragmentStore), and
// every message that is missing by its sender's numbers is counted (MessageNumbers). Every message that came whole is
// handed on, repeated ones too. Pure: no clock, no socket.
class UdpmReceiver {
 public:
  // Of kMaxSenders the one that is silent for longest is forgotten: first those of fewer than kEstablished messages, so
  // that a flood from ever new addresses displaces no sender of the machine.
  static constexpr std::size_t kMaxSenders = 1'024;
  static constexpr std::int64_t kEstablished = 16;

  using Sink = std::function<void(const ReceivedMessage&)>;

  explicit UdpmReceiver(const FragmentLimits& limits = {}) : fragments_(limits) {}

  void On(const Datagram& datagram, const Sink& sink);
  // Nothing more comes: incomplete messages are lost.
  void End();

  [[nodiscard]] std::vector<SenderCount> senders() const;            // most lost first
  [[nodiscard]] std::int64_t received() const { return received_; }  // messages
  [[nodiscard]] std::int64_t lost() const;                           // over all senders, also forgotten ones
  [[nodiscard]] std::size_t fragment_memory() const { return fragments_.memory(); }  // bytes, about
  [[nodiscard]] std::int64_t foreign() const { return foreign_; }  // datagrams that are none of LCM's

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

  std::map<SenderAddress, Sender> senders_;
  std::list<SenderAddress> strangers_;    // the one that is silent for longest first
  std::list<SenderAddress> established_;  // likewise
  FragmentStore fragments_;
  std::int64_t received_ = 0;
  std::int64_t foreign_ = 0;
  std::int64_t lost_of_forgotten_ = 0;
};

}  // namespace axlecast
