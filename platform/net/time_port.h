#pragma once

#include <sys/socket.h>

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/time/time_packet.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// A UDP socket for time exchanges, with an instant of CLOCK_MONOTONIC_RAW for each datagram: read before a datagram is sent, and after
// one was received. Never waits. Used by one thread.
class TimePort {
 public:
  // The root's end: receives requests at the address, an IPv4 or IPv6 address of this host.
  [[nodiscard]] static Result<TimePort> Listen(const std::string& address, int port);
  // The other end: exchanges with the root at the address only.
  [[nodiscard]] static Result<TimePort> Connect(const std::string& address, int port);

  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }

  struct Received {
    TimePacket packet;
    MonoNs raw = 0;  // ns, CLOCK_MONOTONIC_RAW, not before it arrived
  };
  // Returns the next time packet that waits; nothing if none does. Other datagrams are dropped.
  [[nodiscard]] std::optional<Received> Receive();
  // Answers the packet received last: sets `answered` and sends. Fails if the network refuses it.
  [[nodiscard]] Result<> Answer(TimePacket packet);
  // Sends a request. Returns the instant before it left.
  [[nodiscard]] Result<MonoNs> Request(const TimePacket& packet);

 private:
  explicit TimePort(Descriptor socket) : socket_(std::move(socket)) {}

  Descriptor socket_;
  sockaddr_storage peer_{};  // of the packet received last
  socklen_t peer_length_ = 0;
};

}  // namespace axlecast
