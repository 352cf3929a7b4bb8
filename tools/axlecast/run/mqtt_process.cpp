#include "tools/axlecast/run/mqtt_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "platform/os/process.h"

namespace axlecast {
namespace {

constexpr int kGoodbyeMs = 2000;

// Between fork and exec only async-signal-safe calls: this process has threads.
[[noreturn]] void Become(int socket) {
  const int null = open("/dev/null", O_RDWR);
  dup2(socket, STDIN_FILENO);
  dup2(null, STDOUT_FILENO);
  close_range(3, ~0U, 0);
  std::array<char*, 3> argv = {const_cast<char*>("axlecast"), const_cast<char*>(kMqttLinkOption), nullptr};
  execv("/proc/self/exe", argv.data());
  _exit(127);
}

}  // namespace

// Empty when the process runs, else why not.
std::string MqttProcess::Start() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return std::string("cannot make a socket: ") + std::strerror(errno);
  socket_ = Descriptor(ends[0]);
  const Descriptor other(ends[1]);
  if (fcntl(socket_.get(), F_SETFL, O_NONBLOCK) != 0) return std::string("fcntl: ") + std::strerror(errno);
  const pid_t pid = ForkWithoutHandlers();
  if (pid < 0) return std::string("cannot fork: ") + std::strerror(errno);
  if (pid == 0) Become(other.get());
  pid_ = pid;
  return "";
}

void MqttProcess::Connect(const BrokerMessage& will) {
  Drop();
  if (std::string problem = Start(); !problem.empty()) return Down(std::move(problem), true);
  DriverCommand({.kind = LinkOrder::Kind::kConnect, .settings = settings_, .message = will});
  ++settings_.attempts;
}

void MqttProcess::Drop() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    static_cast<void>(Reap());
  }
  socket_ = Descriptor();
  out_.clear();
  events_in_ = FrameBuffer(kLongestEvent);
  events_.clear();
}

void MqttProcess::Disconnect() {
  if (!socket_.valid()) return;
  DriverCommand({.kind = LinkOrder::Kind::kDisconnect});
  // The process closes its end when the broker was told.
  pollfd waits = {socket_.get(), POLLIN, 0};
  while (socket_.valid() && poll(&waits, 1, kGoodbyeMs) > 0) Read();
  Drop();
}

int MqttProcess::Send(const BrokerMessage& message) {
  DriverCommand({.kind = LinkOrder::Kind::kSend, .message = message, .id = ++last_id_});
  return last_id_;
}

void MqttProcess::DriverCommand(const LinkOrder& order) {
  out_ += EncodeOrder(order);
  Write();
}

void MqttProcess::Write() {
  while (socket_.valid() && !out_.empty()) {
    const ssize_t sent = send(socket_.get(), out_.data(), out_.size(), MSG_NOSIGNAL);
    if (sent < 0) return;  // full, or gone: then reading tells
    out_.erase(0, static_cast<std::size_t>(sent));
  }
}

void MqttProcess::Read() {
  std::array<char, 4096> bytes{};
  ssize_t size = 0;
  while ((size = recv(socket_.get(), bytes.data(), bytes.size(), 0)) > 0) {
    events_in_.Add({bytes.data(), static_cast<std::size_t>(size)});
    while (const auto body = events_in_.Next()) {
      auto event = DecodeEvent(*body);
      if (!event) return Down("the process of the connection sent nonsense", true);
      if (event->kind == BrokerEvent::Kind::kConnected) --settings_.attempts;
      events_.push_back(std::move(*event));
    }
    if (events_in_.bad()) return Down("the process of the connection sent nonsense", true);
  }
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  kill(pid_, SIGKILL);  // without effect on one that has ended
  Down("the process of the connection ended: " + Reap(), true);
}

std::vector<BrokerEvent> MqttProcess::Poll() {
  Write();
  if (socket_.valid()) Read();
  return std::exchange(events_, {});
}

pollfd MqttProcess::Waiting() const {
  return {socket_.get(), static_cast<short>(out_.empty() ? POLLIN : POLLIN | POLLOUT), 0};
}

void MqttProcess::Down(std::string text, bool fault) {
  socket_ = Descriptor();
  events_.push_back({BrokerEvent::Kind::kDown, 0, std::move(text), fault});
}

// How the process ended; waits for its end.
std::string MqttProcess::Reap() {
  int status = 0;
  const pid_t pid = std::exchange(pid_, -1);
  while (waitpid(pid, &status, 0) < 0) {
    if (errno != EINTR) return "lost";
  }
  if (!WIFSIGNALED(status)) return "exit code " + std::to_string(WEXITSTATUS(status));
  const int signal = WTERMSIG(status);
  const std::string text = "killed by signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
  return signal == SIGABRT ? text + ": the broker sent what libmosquitto does not bear" : text;
}

}  // namespace axlecast
