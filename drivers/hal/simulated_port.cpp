#include "drivers/hal/simulated_port.h"

#include <poll.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "platform/net/unix_address.h"
#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr MonoNs kGreetingTime = kSecond;
// About ten small packets, like the queue of a CAN interface. The kernel counts 768 bytes for each, and doubles this.
constexpr int kSendBuffer = 4'096;

std::string HowToStart(const std::string& path) {
  return ": start it with `axlecast simulate FILE --bus " + std::filesystem::path(path).stem().string() +
         "`; --plug brings an unplugged bus back";
}

bool Watch(int events, int operation, int fd, std::uint32_t wanted) {
  epoll_event event{};
  event.events = wanted;
  event.data.fd = fd;
  return epoll_ctl(events, operation, fd, &event) == 0;
}

ssize_t SendWhole(int fd, Bytes packet) {
  while (true) {
    const ssize_t sent = send(fd, packet.data(), packet.size(), MSG_NOSIGNAL);
    if (sent >= 0 || errno != EINTR) return sent;
  }
}

ssize_t ReceiveWhole(int fd, std::span<std::uint8_t> into) {
  while (true) {
    // MSG_TRUNC returns the whole length, so that a longer packet is noticed.
    const ssize_t size = recv(fd, into.data(), into.size(), MSG_TRUNC);
    // ECONNRESET comes once, before the remaining packets, if the other end was closed before it had read all.
    if (size >= 0 || (errno != EINTR && errno != ECONNRESET)) return size;
  }
}

Bytes AsBytes(std::string_view text) { return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}; }

}  // namespace

// ---- the end of the host ----

Result<> SimulatedSocket::Connect(const std::string& path, std::string_view protocol, const Clock& clock) {
  Close();
  const Result<UnixAddress> address = UnixAddress::Of(path);
  if (!address) return Failure(address.error());
  Descriptor fresh(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!fresh.valid() || setsockopt(fresh.get(), SOL_SOCKET, SO_SNDBUF, &kSendBuffer, sizeof kSendBuffer) != 0) {
    return Failure(path + ": " + std::strerror(errno));
  }
  if (connect(fresh.get(), address->generic(), address->size()) != 0) {
    const std::string cause = path + ": " + std::strerror(errno);
    return Failure("no simulator serves this bus" + HowToStart(path) + " (" + cause + ')');
  }
  pollfd greeting{fresh.get(), POLLIN, 0};
  if (PollUntil({&greeting, 1}, clock.Now() + kGreetingTime, clock) <= 0) {
    return Failure("the simulator behind " + path + " does not answer: stop it" + HowToStart(path));
  }
  std::array<std::uint8_t, kLongestSimulatedPacket> received{};
  const ssize_t size = ReceiveWhole(fresh.get(), received);
  if (size <= 0) return Failure(path + ": " + std::string(kLineHeld));
  const Bytes wanted = AsBytes(protocol);
  if (size != static_cast<ssize_t>(wanted.size()) || !std::equal(wanted.begin(), wanted.end(), received.begin())) {
    return Failure("what serves " + path + " is not this version's simulator: stop it" + HowToStart(path));
  }
  socket_ = std::move(fresh);
  return {};
}

FrameLink::SendResult SimulatedSocket::Send(Bytes packet) {
  using SendResult = FrameLink::SendResult;
  if (SendWhole(socket_.get(), packet) == static_cast<ssize_t>(packet.size())) return SendResult::kQueued;
  return errno == EAGAIN || errno == ENOBUFS ? SendResult::kFull : SendResult::kLost;
}

ByteLink::ReadResult SimulatedSocket::Receive(std::span<std::uint8_t> into) {
  const ssize_t size = ReceiveWhole(socket_.get(), into);
  if (size < 0 && errno == EAGAIN) return {Link::Status::kTimeout, 0};
  const auto length = static_cast<std::size_t>(std::max<ssize_t>(size, 0));
  if (length == 0 || length > into.size()) return {Link::Status::kLost, 0};
  return {Link::Status::kOk, length};
}

// ---- the end of the simulator ----

Result<> SimulatedSocketPort::Listen(const std::string& path, std::string_view protocol) {
  Close();
  Result<Descriptor> bound = BindUnixSocket(path, SOCK_SEQPACKET);
  if (!bound) return Failure(bound.error());
  Descriptor listener = std::move(*bound);
  events_ = Descriptor(epoll_create1(EPOLL_CLOEXEC));
  if (!events_.valid() || listen(listener.get(), SOMAXCONN) != 0 ||
      !Watch(events_.get(), EPOLL_CTL_ADD, listener.get(), EPOLLIN)) {
    return Failure(path + ": " + std::strerror(errno));
  }
  path_ = path;
  protocol_ = protocol;
  listener_ = std::move(listener);
  return {};
}

void SimulatedSocketPort::Close() {
  if (!IsListening()) return;
  static_cast<void>(unlink(path_.c_str()));
  host_.Reset();
  next_.Reset();
  listener_.Reset();
  events_.Reset();
}

void SimulatedSocketPort::SetReceiving(bool receives) {
  if (receives == receives_) return;
  receives_ = receives;
  if (HasHost() && !Watch(events_.get(), EPOLL_CTL_MOD, host_.get(), receives_ ? std::uint32_t{EPOLLIN} : 0U))
    DropHost();
}

bool SimulatedSocketPort::HostHasGone() const {
  if (!HasHost()) return false;
  pollfd host{host_.get(), 0, 0};
  return poll(&host, 1, 0) != 0;
}

Descriptor SimulatedSocketPort::Accept() {
  return Descriptor(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
}

bool SimulatedSocketPort::Greet(Descriptor caller) {
  if (!Watch(events_.get(), EPOLL_CTL_ADD, caller.get(), EPOLLIN)) return false;
  receives_ = true;
  host_ = std::move(caller);
  if (!Send(AsBytes(protocol_))) DropHost();
  return HasHost();
}

bool SimulatedSocketPort::Welcome() {
  if (!IsListening()) return false;
  Descriptor caller = next_.valid() ? std::move(next_) : Accept();
  for (; caller.valid(); caller = Accept()) {
    if (HostHasGone()) {
      next_ = std::move(caller);
      return true;
    }
    if (!HasHost() && Greet(std::move(caller))) return true;
  }
  return false;
}

std::optional<Bytes> SimulatedSocketPort::Next() {
  if (!HasHost() || !receives_) return std::nullopt;
  const ssize_t size = ReceiveWhole(host_.get(), packet_);
  if (size < 0 && errno == EAGAIN) return std::nullopt;
  const auto length = static_cast<std::size_t>(std::max<ssize_t>(size, 0));
  if (length == 0 || length > packet_.size()) {
    DropHost();
    return std::nullopt;
  }
  return Bytes(packet_).first(length);
}

bool SimulatedSocketPort::Send(Bytes packet) {
  return HasHost() && SendWhole(host_.get(), packet) == static_cast<ssize_t>(packet.size());
}

}  // namespace axlecast
