#include "tools/axlecast/run/control_socket.h"

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>

#include "platform/net/unix_address.h"

namespace axlecast {
namespace {

constexpr std::size_t kMaxCallers = 16;
constexpr std::size_t kLongestMessage = 64 * 1024;

std::optional<std::string> Receive(int fd, int flags) {
  std::string message(kLongestMessage, '\0');
  const ssize_t size = recv(fd, message.data(), message.size(), flags);
  if (size < 0) return std::nullopt;
  message.resize(static_cast<std::size_t>(size));
  return message;
}

bool SendLine(int fd, const std::string& message) {
  return send(fd, message.data(), message.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(message.size());
}

bool Watch(int events, int fd) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = fd;
  return epoll_ctl(events, EPOLL_CTL_ADD, fd, &event) == 0;
}

}  // namespace

ControlSocket::~ControlSocket() {
  if (listener_.valid()) static_cast<void>(unlink(path_.c_str()));
}

Result<> ControlSocket::Listen(const std::string& path) {
  Result<Descriptor> bound = BindUnixSocket(path, SOCK_SEQPACKET);
  if (!bound) return Failure(bound.error());
  Descriptor listener = std::move(*bound);
  events_ = Descriptor(epoll_create1(EPOLL_CLOEXEC));
  if (!events_.valid() || listen(listener.get(), kMaxCallers) != 0 || !Watch(events_.get(), listener.get())) {
    return Failure(path + ": " + std::strerror(errno));
  }
  path_ = path;
  listener_ = std::move(listener);
  return {};
}

void ControlSocket::Accept() {
  Descriptor caller(accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  if (!caller.valid() || !Watch(events_.get(), caller.get())) return;
  callers_.push_back(std::move(caller));
  // A caller that sends nothing must not block others.
  if (callers_.size() > kMaxCallers) callers_.pop_front();
}

void ControlSocket::Serve(const Handler& handler) {
  std::array<epoll_event, kMaxCallers + 1> ready{};
  const int count = epoll_wait(events_.get(), ready.data(), static_cast<int>(ready.size()), 0);
  for (int i = 0; i < count; ++i) {
    const int fd = ready.at(static_cast<std::size_t>(i)).data.fd;
    if (fd == listener_.get()) {
      Accept();
      continue;
    }
    const auto caller =
        std::find_if(callers_.begin(), callers_.end(), [fd](const Descriptor& d) { return d.get() == fd; });
    if (caller == callers_.end()) continue;
    const std::optional<std::string> question = Receive(fd, MSG_DONTWAIT);
    if (question && !question->empty()) static_cast<void>(SendLine(fd, handler(*question)));
    callers_.erase(caller);
  }
}

std::string AskControlSocket(const std::string& path, const std::string& question) {
  const std::optional<UnixAddress> address = UnixAddress::Of(path);
  const Descriptor caller(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  const timeval patience{2, 0};
  if (!address || !caller.valid() ||
      setsockopt(caller.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience)) != 0 ||
      connect(caller.get(), address->generic(), address->size()) != 0 || !SendLine(caller.get(), question)) {
    return {};
  }
  return Receive(caller.get(), 0).value_or("");
}

}  // namespace axlecast
