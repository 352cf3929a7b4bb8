#include "drivers/hal/simulated_lines.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "platform/net/unix_address.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

// A pulse on its way: the line's index, then the ns that it was low, low byte first.
constexpr std::size_t kDatagram = 1 + sizeof(MonoNs);
using Datagram = std::array<std::uint8_t, kDatagram>;

Datagram Encode(std::uint8_t line, MonoNs low) {
  Datagram datagram{line};
  for (std::size_t i = 1; i < kDatagram; ++i) datagram[i] = static_cast<std::uint8_t>(low >> (8 * (i - 1)));
  return datagram;
}

Pulse Decode(const Datagram& datagram) {
  std::uint64_t low = 0;
  for (std::size_t i = kDatagram - 1; i > 0; --i) low = low << 8 | datagram[i];
  return {.line = datagram[0], .low = static_cast<MonoNs>(low)};
}

}  // namespace

// ---- the driver's end ----

std::string SimulatedLines::Open() {
  const std::optional<UnixAddress> address = UnixAddress::Of(path_);
  if (!address) return UnixAddress::TooLong(path_);
  Descriptor socket_to_it(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket_to_it.valid()) return path_ + ": " + std::strerror(errno);
  if (connect(socket_to_it.get(), address->generic(), address->size()) != 0) {
    return "no simulator moves the lines of this bus (" + path_ + ": " + std::strerror(errno) +
           "): start it with `axlecast simulate`";
  }
  socket_ = std::move(socket_to_it);
  return "";
}

bool SimulatedLines::Pulse(std::uint8_t line, MonoNs low) {
  WaitUntil(clock_.Now() + low, clock_);
  const Datagram datagram = Encode(line, low);
  const auto sent = [&] {
    return send(socket_.get(), datagram.data(), datagram.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(datagram.size());
  };
  // ECONNREFUSED the first time after the simulator has gone, ENOTCONN from then on.
  return sent() || ((errno == ECONNREFUSED || errno == ENOTCONN) && Open().empty() && sent());
}

// ---- the simulator's end ----

SimulatedLinesPort::~SimulatedLinesPort() {
  if (socket_.valid()) static_cast<void>(unlink(path_.c_str()));
}

std::string SimulatedLinesPort::Listen(const std::string& path) {
  std::string problem = BindUnixSocket(path, SOCK_DGRAM, socket_);
  if (problem.empty()) path_ = path;
  return problem;
}

std::optional<Pulse> SimulatedLinesPort::Next() {
  while (true) {
    Datagram datagram{};
    // MSG_TRUNC: the datagram's whole length, so that a longer one shows.
    const ssize_t size = recv(socket_.get(), datagram.data(), datagram.size(), MSG_TRUNC);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return std::nullopt;
    if (size != static_cast<ssize_t>(kDatagram)) continue;
    const axlecast::Pulse pulse = Decode(datagram);
    if (pulse.low >= 0) return pulse;
  }
}

}  // namespace axlecast
