#include "tools/axlecast/run/simulation_server.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <optional>

#include "core/messages/json/field.h"
#include "drivers/hal/can_socket.h"
#include "drivers/hal/pty.h"
#include "drivers/hal/simulated_can.h"
#include "drivers/hal/simulated_spi.h"
#include "platform/net/unix_address.h"
#include "platform/os/system_clock.h"

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

constexpr MonoNs kHostCheck = 10 * kMillisecond;  // how soon a host that opens the line is detected
constexpr MonoNs kReopen = 100 * kMillisecond;

// A simulated serial line: a pty.
class SimulatedPty final : public SimulatedPort {
 public:
  // `path`: of the link that a host opens.
  SimulatedPty(std::string path, Simulator& simulator, const Clock& clock)
      : SimulatedPort(simulator, clock), path_(std::move(path)) {}

  [[nodiscard]] Result<> Plug() override {
    Unplug();
    Result<> opened = pty_.Open(path_);
    if (opened) LookForHost();
    return opened;
  }

  void Unplug() override {
    has_host_ = false;
    look_at_ = kNever;
    pty_.Close();
  }

  [[nodiscard]] bool HasHost() const override { return has_host_; }
  // A pty without a host would be readable all the time. NextDue then causes a check for a host.
  [[nodiscard]] int FileDescriptor() const override { return has_host_ ? pty_.FileDescriptor() : -1; }
  [[nodiscard]] MonoNs NextDue() const override { return look_at_; }

  void Serve() override {
    if (!pty_.IsOpen()) return;
    if (!has_host_) LookForHost();
    if (!has_host_) return;
    PassBaud();
    const std::size_t count = pty_.Read(received_);
    if (count > 0) {
      return simulator().OnBytes(Bytes(received_).first(count), Now(), [this](Bytes bytes) { Transmit(bytes); });
    }
    LookForHost();
    if (!has_host_) pty_.Discard();
  }

  void Transmit(Bytes bytes) override {
    if (has_host_) static_cast<void>(pty_.Write(bytes));
  }

 private:
  [[nodiscard]] std::int64_t Baud() const override { return has_host_ ? pty_.Baud() : 0; }

  void LookForHost() {
    has_host_ = pty_.HasHost();
    look_at_ = has_host_ ? kNever : Now() + kHostCheck;
  }

  const std::string path_;
  Pty pty_;
  bool has_host_ = false;
  MonoNs look_at_ = kNever;
  std::array<std::uint8_t, 512> received_{};
};

// The simulated nodes of a CAN bus on a Linux interface: together with real nodes, or connected to a driver on another
// interface of the same bus. The interface's controller acknowledges frames, whatever the simulator returns.
class SimulatedInterface final : public SimulatedPort {
 public:
  // `interface`: can1.
  SimulatedInterface(const std::string& interface, Simulator& simulator, const Clock& clock)
      : SimulatedPort(simulator, clock), socket_({.interface = interface, .filters = {}, .sole = false}, clock) {}

  // The interface must be up. Later it may go down and come back.
  [[nodiscard]] Result<> Plug() override {
    Unplug();
    Result<> opened = socket_.Open();
    if (!opened) return opened;
    bitrate_ = socket_.Controller().bitrate;
    PassBaud();
    return {};
  }

  void Unplug() override {
    socket_.Close();
    bitrate_ = 0;
    reopen_at_ = kNever;
  }

  [[nodiscard]] bool HasHost() const override { return socket_.IsOpen(); }
  [[nodiscard]] int FileDescriptor() const override { return socket_.FileDescriptor(); }
  [[nodiscard]] MonoNs NextDue() const override { return reopen_at_; }

  void Serve() override {
    if (reopen_at_ <= Now() && !Plug()) reopen_at_ = Now() + kReopen;
    if (!socket_.IsOpen()) return;
    FrameLink::Received received;
    FrameLink::Status status = socket_.Receive(received);
    for (; status == FrameLink::Status::kOk; status = socket_.Receive(received)) {
      if (received.own || (received.frame.id & kCanError) != 0) continue;
      // The controller has already acknowledged it.
      static_cast<void>(simulator().OnFrame(received.frame, Now(), [this](Bytes bytes) { Transmit(bytes); }));
    }
    if (status != FrameLink::Status::kLost) return;
    Unplug();
    reopen_at_ = Now() + kReopen;
  }

  void Transmit(Bytes bytes) override {
    const std::optional<CanFrame> frame = FromPacket(bytes);
    // If the queue is full, the frame is lost, as in a real node.
    if (frame && socket_.IsOpen()) static_cast<void>(socket_.Send(*frame));
  }

 private:
  [[nodiscard]] std::int64_t Baud() const override { return bitrate_; }

  CanSocket socket_;
  std::int64_t bitrate_ = 0;
  MonoNs reopen_at_ = kNever;
};

using Json = nlohmann::ordered_json;

// Returns a number if the text is one.
Json Value(const std::string& text) {
  Json value = Json::parse(text, nullptr, false);
  return value.is_number() ? value : Json(text);
}

std::unique_ptr<SimulatedPort> MakePort(const SimulationServer::BusPlace& place, Simulator& simulator,
                                        const Clock& clock) {
  if (!place.interface.empty()) return std::make_unique<SimulatedInterface>(place.interface, simulator, clock);
  switch (place.link) {
    case LinkKind::kCan:
      return std::make_unique<SimulatedCanPort>(place.port, simulator, clock);
    case LinkKind::kSpi:
      return std::make_unique<SimulatedSpiPort>(place.port, simulator, clock);
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      break;
  }
  return std::make_unique<SimulatedPty>(place.port, simulator, clock);
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
  const Result<UnixAddress> address = UnixAddress::Of(path);
  const Descriptor caller(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  const timeval patience{2, 0};
  if (!address || !caller.valid() ||
      setsockopt(caller.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience)) != 0 ||
      connect(caller.get(), address->generic(), address->size()) != 0 || !SendLine(caller.get(), question)) {
    return {};
  }
  return Receive(caller.get(), 0).value_or("");
}

SimulationServer::SimulationServer(const Clock& clock) : clock_(clock) {}

Result<> SimulationServer::Add(BusPlace place, std::unique_ptr<Simulator> simulator) {
  auto bus = std::make_unique<Bus>();
  bus->place = std::move(place);
  bus->simulator = std::move(simulator);
  if (const Result<> locked = bus->lock.Acquire(bus->place.lock); !locked) {
    return Failure("bus " + bus->place.bus + " is simulated already: " + locked.error().text);
  }
  bus->port = MakePort(bus->place, *bus->simulator, clock_);
  if (Result<> plugged = bus->port->Plug(); !plugged) return plugged;
  if (!bus->place.lines.empty()) {
    if (Result<> listening = bus->lines.Listen(bus->place.lines); !listening) return listening;
  }
  if (Result<> listening = bus->control.Listen(bus->place.control); !listening) return listening;
  buses_.push_back(std::move(bus));
  return {};
}

void SimulationServer::Stop() { stop_.Set(); }

// ---- the loop ----

MonoNs SimulationServer::NextDue() const {
  MonoNs due = kNever;
  for (const auto& bus : buses_) due = std::min({due, bus->simulator->NextDue(), bus->port->NextDue()});
  return due;
}

// Lists the stop event, then for each bus its port, its lines and its control socket.
void SimulationServer::FillPolls(std::vector<pollfd>& polls) const {
  polls.assign(1, {stop_.FileDescriptor(), POLLIN, 0});
  for (const auto& bus : buses_) {
    polls.push_back({bus->port->FileDescriptor(), POLLIN, 0});
    polls.push_back({bus->lines.FileDescriptor(), POLLIN, 0});
    polls.push_back({bus->control.FileDescriptor(), POLLIN, 0});
  }
}

Result<> SimulationServer::Run() {
  if (!stop_.valid()) return Failure(std::string("cannot create an event: ") + std::strerror(errno));
  prctl(PR_SET_TIMERSLACK, 1UL);
  std::vector<pollfd> polls;
  while (true) {
    FillPolls(polls);
    if (PollUntil(polls, NextDue(), clock_) < 0)
      return Failure(std::string("cannot wait: ") + std::strerror(errno));
    if (polls[0].revents != 0) return {};
    for (std::size_t i = 0; i < buses_.size(); ++i) ServeBus(*buses_[i], std::span(polls).subspan(1 + 3 * i, 3));
  }
}

void SimulationServer::ServeBus(Bus& bus, std::span<const pollfd> polls) {
  const MonoNs now = clock_.Now();
  if (bus.simulator->NextDue() <= now) {
    bus.port->PassBaud();
    bus.simulator->OnDue(now, [&bus](Bytes bytes) { bus.port->Transmit(bytes); });
  }
  if (polls[0].revents != 0 || bus.port->NextDue() <= now) bus.port->Serve();
  if (polls[1].revents != 0) OnPulses(bus);
  if (polls[2].revents != 0) bus.control.Serve([&](const std::string& question) { return Answer(bus, question); });
}

void SimulationServer::OnPulses(Bus& bus) {
  bus.port->Serve();  // data from before the pulse, or only a new host
  bus.port->PassBaud();
  while (const std::optional<Pulse> pulse = bus.lines.Next()) {
    bus.simulator->OnPulse(pulse->line, pulse->low, clock_.Now(), [&bus](Bytes b) { bus.port->Transmit(b); });
  }
}

// ---- questions of other processes ----

std::string SimulationServer::Answer(Bus& bus, const std::string& text) {
  const Json question = ParseOutsideJson(text);
  if (!question.is_object()) return Json{{"errors", {"the question is no JSON object"}}}.dump();
  return (question.contains("show") ? Show(bus) : Change(bus, question)).dump();
}

Json SimulationServer::Change(Bus& bus, const Json& question) {
  Json errors = Json::array();
  for (const Json& change : question.value("set", Json::array())) {
    const auto words = change.is_array() ? change.get<std::vector<Json>>() : std::vector<Json>();
    if (words.size() != 3 ||
        !std::all_of(words.begin(), words.end(), [](const Json& w) { return w.is_string(); })) {
      errors.push_back("a change is [device, key, value]");
      continue;
    }
    const Result<> set = bus.simulator->Set(words[0].get<std::string>(), words[1].get<std::string>(),
                                            words[2].get<std::string>(), clock_.Now());
    if (!set) errors.push_back(set.error().text);
  }
  if (question.contains("plugged") && question["plugged"].is_boolean()) {
    bus.plugged = question["plugged"].get<bool>();
    if (!bus.plugged) bus.port->Unplug();
    const Result<> plugged = bus.plugged ? bus.port->Plug() : Result<>();
    if (!plugged) errors.push_back(plugged.error().text);
  }
  return {{"errors", errors}};
}

Json SimulationServer::Show(const Bus& bus) const {
  const MonoNs now = clock_.Now();
  Json devices = Json::object();
  for (const std::string& device : bus.place.devices) {
    Json& quantities = devices[device] = Json::object();
    for (const auto& [name, value] : bus.simulator->State(device, now)) quantities[name] = Value(value);
  }
  return {{"bus", bus.place.bus},   {"port", bus.place.interface.empty() ? bus.place.port : bus.place.interface},
          {"plugged", bus.plugged}, {"host", bus.port->HasHost()},
          {"mono_ns", now},         {"devices", devices}};
}

}  // namespace axlecast
