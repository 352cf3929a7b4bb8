#include "platform/net/time_port.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t length = 0;

  [[nodiscard]] const sockaddr* get() const { return reinterpret_cast<const sockaddr*>(&storage); }
};

std::string Reason() { return std::strerror(errno); }

Result<SocketAddress> Parse(const std::string& address, int port) {
  SocketAddress parsed;
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  if (inet_pton(AF_INET, address.c_str(), &v4.sin_addr) == 1) {
    v4.sin_family = AF_INET;
    v4.sin_port = htons(static_cast<std::uint16_t>(port));
    std::memcpy(&parsed.storage, &v4, sizeof v4);
    parsed.length = sizeof v4;
    return parsed;
  }
  if (inet_pton(AF_INET6, address.c_str(), &v6.sin6_addr) == 1) {
    v6.sin6_family = AF_INET6;
    v6.sin6_port = htons(static_cast<std::uint16_t>(port));
    std::memcpy(&parsed.storage, &v6, sizeof v6);
    parsed.length = sizeof v6;
    return parsed;
  }
  return Failure("'" + address + "' is no IP address");
}

Result<Descriptor> OpenSocket(const SocketAddress& address) {
  Descriptor socket(::socket(address.storage.ss_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!socket.valid()) return Failure("cannot open a socket: " + Reason());
  return socket;
}

std::string Place(const std::string& address, int port) { return address + ", UDP port " + std::to_string(port); }

}  // namespace

Result<TimePort> TimePort::Listen(const std::string& address, int port) {
  const Result<SocketAddress> parsed = Parse(address, port);
  if (!parsed) return Failure(parsed.error());
  Result<Descriptor> socket = OpenSocket(*parsed);
  if (!socket) return Failure(socket.error());
  if (bind(socket->get(), parsed->get(), parsed->length) == 0) return TimePort(std::move(*socket));
  const int error = errno;
  std::string text = "cannot receive time requests at " + Place(address, port) + ": " + Reason();
  if (error == EADDRNOTAVAIL)
    text += ". `time: address:` must be an address of this host, the root: `ip address` lists them";
  if (error == EADDRINUSE)
    text += ". Another `axlecast time` runs on this host: end it, or change the port in `time: address:`";
  return Failure(std::move(text));
}

Result<TimePort> TimePort::Connect(const std::string& address, int port) {
  const Result<SocketAddress> parsed = Parse(address, port);
  if (!parsed) return Failure(parsed.error());
  Result<Descriptor> socket = OpenSocket(*parsed);
  if (!socket) return Failure(socket.error());
  if (connect(socket->get(), parsed->get(), parsed->length) != 0) {
    return Failure("cannot reach the root at " + Place(address, port) + ": " + Reason());
  }
  return TimePort(std::move(*socket));
}

std::optional<TimePort::Received> TimePort::Receive() {
  while (true) {
    std::array<std::uint8_t, kTimePacketBytes + 1> bytes;  // one more, so that a longer datagram is seen
    peer_length_ = sizeof peer_;
    const ssize_t size =
        recvfrom(socket_.get(), bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&peer_), &peer_length_);
    const MonoNs raw = RawNow();
    if (size < 0) {
      // An earlier request met a closed port or a dead network: that it has no answer is noticed anyway.
      if (errno == ECONNREFUSED || errno == EHOSTUNREACH || errno == ENETUNREACH || errno == EINTR) continue;
      return std::nullopt;
    }
    const auto packet = DecodedTimePacket(std::span(bytes).first(static_cast<std::size_t>(size)));
    if (packet) return Received{*packet, raw};
  }
}

Result<> TimePort::Answer(TimePacket packet) {
  packet.answered = RawNow();
  const TimePacketBytes bytes = Encoded(packet);
  const ssize_t sent =
      sendto(socket_.get(), bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&peer_), peer_length_);
  if (sent == static_cast<ssize_t>(bytes.size())) return {};
  return Failure("cannot send: " + Reason());
}

Result<MonoNs> TimePort::Request(const TimePacket& packet) {
  const TimePacketBytes bytes = Encoded(packet);
  const MonoNs before = RawNow();
  if (send(socket_.get(), bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size())) return before;
  return Failure("cannot send: " + Reason());
}

}  // namespace axlecast
