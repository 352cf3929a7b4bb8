#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <map>
#include <optional>

#include "platform/os/process.h"
#include "platform/os/secret_file.h"
#include "tools/axlecast/common/exit_code.h"
#include "tools/axlecast/run/mqtt_process.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestOrder = 16 << 20;
constexpr std::size_t kMemory = 128 << 20;  // a broker may announce packets of 256 MB
constexpr int kTurnMs = 1000;               // libmosquitto's keep-alive is looked after so often

class LinkServer {
 public:
  int Run() {
    while (!ended_) {
      std::array<pollfd, 2> files = {{{STDIN_FILENO, POLLIN, 0}, {-1, 0, 0}}};
      if (link_) files[1] = link_->Waiting();
      if (poll(files.data(), files.size(), kTurnMs) < 0 && errno != EINTR) return kExitFailed;
      if (files[0].revents != 0) Read();
      if (link_ && !ended_) Tell();
    }
    return kExitDone;
  }

 private:
  void Read() {
    std::array<char, 1 << 16> bytes{};
    const ssize_t size = recv(STDIN_FILENO, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
    ended_ = size <= 0;
    if (size > 0) orders_.Add({bytes.data(), static_cast<std::size_t>(size)});
    while (const auto body = orders_.Next()) {
      const auto order = DecodeOrder(*body);
      if (order) Do(*order);
      ended_ = ended_ || !order;
    }
    ended_ = ended_ || orders_.bad();
  }

  void Do(const LinkOrder& order) {
    if (order.kind == LinkOrder::Kind::kConnect) {
      link_.emplace(order.settings, secrets_);
      link_->Connect(order.message);
    } else if (order.kind == LinkOrder::Kind::kDisconnect) {
      if (link_) link_->Disconnect();
      ended_ = true;
    } else if (link_ && !is_down_) {
      ids_[link_->Send(order.message)] = order.id;
    }
  }

  void Tell() {
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
  FrameBuffer orders_{kLongestOrder};
  std::map<int, std::int32_t> ids_;  // of libmosquitto's numbers
  bool is_down_ = false;
  bool ended_ = false;
};

}  // namespace

int ServeMqttLink() {
  // The end is the other side's to tell: what a terminal or systemd tells all processes is for that one.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) static_cast<void>(::signal(signal, SIG_IGN));
  static_cast<void>(ForbidCoreDumps());
  static_cast<void>(LimitMemory(kMemory));
  return LinkServer().Run();
}

}  // namespace axlecast
