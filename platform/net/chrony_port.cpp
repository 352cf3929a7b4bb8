#include "platform/net/chrony_port.h"

#include <netinet/in.h>
#include <sys/random.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <span>

namespace axlecast {

ChronyPort::ChronyPort() : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kChronyPort);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  // Without lo, there is no reply; the next start tries again.
  if (connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) socket_.Reset();
}

void ChronyPort::Ask() {
  // Random, so that a program that cannot read the request cannot answer it.
  if (getrandom(&sequence_, sizeof sequence_, GRND_NONBLOCK) != sizeof sequence_) ++sequence_;
  const ChronyRequest request = TrackingRequest(sequence_);
  [[maybe_unused]] const ssize_t sent = send(socket_.get(), request.data(), request.size(), MSG_DONTWAIT);
}

std::optional<ChronyTracking> ChronyPort::Receive() {
  std::array<std::uint8_t, kChronyPacketBytes + 1> bytes;  // one more, so that a longer datagram is seen
  while (true) {
    const ssize_t size = recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (size < 0 && (errno == EINTR || errno == ECONNREFUSED)) continue;  // nobody received the request
    if (size < 0) return std::nullopt;
    if (auto tracking = DecodedTracking(std::span(bytes).first(static_cast<std::size_t>(size)), sequence_))
      return tracking;
  }
}

}  // namespace axlecast
