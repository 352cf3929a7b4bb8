#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/program.h"
#include "tools/axlecast/common/terminal.h"
#include "tools/axlecast/run/mqtt_process.h"

namespace axlecast {
namespace {

constexpr int kDisconnectMs = 2000;

// Between fork and exec, only async-signal-safe calls are allowed: this process has threads.
[[noreturn]] void Execute(int socket) {
  const int null = open("/dev/null", O_RDWR);
  dup2(socket, STDIN_FILENO);
  dup2(null, STDOUT_FILENO);
  close_range(3, ~0U, 0);
  std::array<char*, 3> argv = {const_cast<char*>("axlecast"), const_cast<char*>(kMqttLinkOption), nullptr};
  execv("/proc/self/exe", argv.data());
  _exit(127);
}

constexpr std::size_t kMaxCommandBytes = 16 << 20;
constexpr std::size_t kMemory = 128 << 20;  // a broker may announce packets of 256 MB
constexpr int kPollMs = 1000;               // interval at which libmosquitto can send its keep-alive

class LinkServer {
 public:
  int Run() {
    while (!ended_) {
      std::array<pollfd, 2> files = {{{STDIN_FILENO, POLLIN, 0}, {-1, 0, 0}}};
      if (link_) files[1] = link_->Waiting();
      if (poll(files.data(), files.size(), kPollMs) < 0 && errno != EINTR) return kExitFailed;
      // What the broker has sent is read first: a write to a connection that the broker has closed would hide the reason.
      if (link_ && files[1].revents != 0) SendEvents();
      if (files[0].revents != 0 && !ended_) Read();
      if (link_ && !ended_) SendEvents();
    }
    return kExitDone;
  }

 private:
  void Read() {
    std::array<char, 1 << 16> bytes{};
    const ssize_t size = recv(STDIN_FILENO, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    ended_ = size <= 0;
    if (size > 0) commands_.Add({bytes.data(), static_cast<std::size_t>(size)});
    while (const auto body = commands_.Next()) {
      const auto command = DecodeCommand(*body);
      if (command) Do(*command);
      ended_ = ended_ || !command;
    }
    ended_ = ended_ || commands_.bad();
  }

  void Do(const LinkCommand& command) {
    if (command.kind == LinkCommand::Kind::kConnect) {
      link_.emplace(command.settings, secrets_);
      link_->Connect(command.message);
    } else if (command.kind == LinkCommand::Kind::kDisconnect) {
      if (link_) link_->Disconnect(command.publish_will);
      ended_ = true;
    } else if (link_ && !is_down_ && command.kind == LinkCommand::Kind::kSubscribe) {
      ids_[link_->Subscribe(command.message.topic)] = command.id;
    } else if (link_ && !is_down_) {
      ids_[link_->Send(command.message)] = command.id;
    }
  }

  void SendEvents() {
    for (BrokerEvent event : link_->Poll()) {
      is_down_ = is_down_ || event.kind == BrokerEvent::Kind::kDown;
      if (event.kind == BrokerEvent::Kind::kTaken || event.kind == BrokerEvent::Kind::kRefused) {
        const auto id = ids_.find(event.message);
        if (id == ids_.end()) continue;
        event.message = id->second;
        ids_.erase(id);
      }
      const std::string frame = EncodeEvent(event);
      ended_ = ended_ ||
               send(STDIN_FILENO, frame.data(), frame.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(frame.size());
    }
  }

  SecretFiles secrets_;
  std::optional<MqttLink> link_;
  FrameBuffer commands_{kMaxCommandBytes};
  std::map<int, std::int32_t> ids_;  // by the numbers of libmosquitto
  bool is_down_ = false;
  bool ended_ = false;
};

}  // namespace

Result<> MqttProcess::Start() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return Failure(std::string("cannot create a socket: ") + std::strerror(errno));
  }
  socket_ = Descriptor(ends[0]);
  const Descriptor other(ends[1]);
  if (fcntl(socket_.get(), F_SETFL, O_NONBLOCK) != 0) return Failure(std::string("fcntl: ") + std::strerror(errno));
  const pid_t pid = ForkWithoutHandlers();
  if (pid < 0) return Failure(std::string("cannot fork: ") + std::strerror(errno));
  if (pid == 0) Execute(other.get());
  pid_ = pid;
  return {};
}

void MqttProcess::Connect(const BrokerMessage& will) {
  Drop();
  if (const Result<> started = Start(); !started) return Down(started.error().text, true);
  SendCommand({.kind = LinkCommand::Kind::kConnect, .settings = settings_, .message = will});
  ++settings_.attempts;
}

void MqttProcess::Drop() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    static_cast<void>(Reap());
  }
  socket_ = Descriptor();
  out_.clear();
  events_in_ = FrameBuffer(kMaxEventBytes);
  events_.clear();
}

void MqttProcess::Disconnect(bool publish_will) {
  if (!socket_.valid()) return;
  SendCommand({.kind = LinkCommand::Kind::kDisconnect, .publish_will = publish_will});
  // The process closes its end after it has disconnected from the broker.
  pollfd waits = {socket_.get(), POLLIN, 0};
  while (socket_.valid() && poll(&waits, 1, kDisconnectMs) > 0) Read();
  Drop();
}

int MqttProcess::Send(const BrokerMessage& message) {
  SendCommand({.kind = LinkCommand::Kind::kSend, .message = message, .id = ++last_id_});
  return last_id_;
}

int MqttProcess::Subscribe(const std::string& filter) {
  SendCommand({.kind = LinkCommand::Kind::kSubscribe, .message = {.topic = filter}, .id = ++last_id_});
  return last_id_;
}

void MqttProcess::SendCommand(const LinkCommand& command) {
  out_ += EncodeCommand(command);
  Write();
}

void MqttProcess::Write() {
  while (socket_.valid() && !out_.empty()) {
    const ssize_t sent = send(socket_.get(), out_.data(), out_.size(), MSG_NOSIGNAL);
    if (sent < 0) return;  // full, or closed: Read detects that
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
      if (!event) return Down("the process of the connection sent malformed data", true);
      if (event->kind == BrokerEvent::Kind::kConnected) --settings_.attempts;
      events_.push_back(std::move(*event));
    }
    if (events_in_.bad()) return Down("the process of the connection sent malformed data", true);
  }
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
  kill(pid_, SIGKILL);  // no effect if it has ended
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

// Waits for the end of the process, and returns how it ended.
std::string MqttProcess::Reap() {
  int status = 0;
  const pid_t pid = std::exchange(pid_, -1);
  while (waitpid(pid, &status, 0) < 0) {
    if (errno != EINTR) return "lost";
  }
  const bool aborted = WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
  return ExitText(status) + (aborted ? ": the broker sent data that libmosquitto cannot handle" : "");
}

int ServeMqttLink() {
  // The main process ends this one: signals from a terminal or systemd to all processes are ignored here.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) static_cast<void>(::signal(signal, SIG_IGN));
  static_cast<void>(ForbidCoreDumps());
  static_cast<void>(LimitMemory(kMemory));
  return LinkServer().Run();
}

}  // namespace axlecast
