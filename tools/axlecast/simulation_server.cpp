#include "tools/axlecast/simulation_server.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <span>

namespace axlecast {
namespace {

constexpr MonoNs kHostCheck = 10 * kMillisecond;  // how soon a host that opens the line is noticed

using Json = nlohmann::ordered_json;

// Numbers stay numbers.
Json Value(const std::string& text) {
  Json value = Json::parse(text, nullptr, false);
  return value.is_number() ? value : Json(text);
}

timespec Timeout(MonoNs wait) {
  wait = std::max<MonoNs>(0, wait);
  return {static_cast<time_t>(wait / kSecond), static_cast<long>(wait % kSecond)};
}

}  // namespace

SimulationServer::SimulationServer(const Clock& clock)
    : clock_(clock), stop_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

std::string SimulationServer::Add(BusPlace place, std::unique_ptr<Simulator> simulator) {
  auto bus = std::make_unique<Bus>();
  bus->place = std::move(place);
  bus->simulator = std::move(simulator);
  if (std::string held = bus->lock.Acquire(bus->place.lock); !held.empty()) {
    return "bus " + bus->place.bus + " is simulated already: " + held;
  }
  if (std::string problem = bus->pty.Open(bus->place.pty); !problem.empty()) return problem;
  if (!bus->place.lines.empty()) {
    if (std::string problem = bus->lines.Listen(bus->place.lines); !problem.empty()) return problem;
  }
  if (std::string problem = bus->control.Listen(bus->place.control); !problem.empty()) return problem;
  bus->transmit = [b = bus.get()](Bytes bytes) {
    // A line without a host, or with one that does not read, loses what is sent.
    if (b->has_host) static_cast<void>(b->pty.Write(bytes));
  };
  buses_.push_back(std::move(bus));
  return {};
}

void SimulationServer::Stop() {
  const std::uint64_t one = 1;
  static_cast<void>(!write(stop_.get(), &one, sizeof(one)));
}

// ---- the loop ----

MonoNs SimulationServer::NextDue() const {
  MonoNs due = kNever;
  for (const auto& bus : buses_) due = std::min(due, bus->simulator->NextDue());
  return due;
}

// The stop event, then of each bus its pty, its lines and its control socket. A pty without a host would report that
// at once, again and again: it is left out.
void SimulationServer::FillPolls(std::vector<pollfd>& polls) const {
  polls.assign(1, {stop_.get(), POLLIN, 0});
  for (const auto& bus : buses_) {
    polls.push_back({bus->has_host ? bus->pty.FileDescriptor() : -1, POLLIN, 0});
    polls.push_back({bus->lines.FileDescriptor(), POLLIN, 0});
    polls.push_back({bus->control.FileDescriptor(), POLLIN, 0});
  }
}

std::string SimulationServer::Run() {
  if (!stop_.valid()) return std::string("cannot create an event: ") + std::strerror(errno);
  prctl(PR_SET_TIMERSLACK, 1UL);
  std::vector<pollfd> polls;
  while (true) {
    bool all_hosts = true;
    for (auto& bus : buses_) {
      if (!bus->has_host) LookForHost(*bus);
      all_hosts = all_hosts && bus->has_host;
    }
    FillPolls(polls);
    const MonoNs due = NextDue();
    MonoNs wait = due == kNever ? kNever : due - clock_.Now();
    if (!all_hosts) wait = std::min(wait, kHostCheck);
    const timespec timeout = Timeout(wait);
    const int count = ppoll(polls.data(), polls.size(), wait == kNever ? nullptr : &timeout, nullptr);
    if (count < 0 && errno != EINTR) return std::string("cannot wait: ") + std::strerror(errno);
    if (count < 0) continue;
    if (polls[0].revents != 0) return {};
    const MonoNs now = clock_.Now();
    for (std::size_t i = 0; i < buses_.size(); ++i) {
      Bus& bus = *buses_[i];
      const std::span<const pollfd> ready = std::span(polls).subspan(1 + 3 * i, 3);
      if (bus.simulator->NextDue() <= now) {
        TellBaud(bus);
        bus.simulator->OnDue(now, bus.transmit);
      }
      if (ready[0].revents != 0) OnPty(bus, ready[0], now);
      if (ready[1].revents != 0) OnPulses(bus);
      if (ready[2].revents != 0) bus.control.Serve([&](const std::string& q) { return Answer(bus, q); });
    }
  }
}

void SimulationServer::LookForHost(Bus& bus) { bus.has_host = bus.pty.IsOpen() && bus.pty.HasHost(); }

void SimulationServer::TellBaud(Bus& bus) {
  const std::int64_t baud = bus.has_host ? bus.pty.Baud() : 0;
  if (baud == 0 || baud == bus.baud) return;
  bus.baud = baud;
  bus.simulator->OnBaud(baud);
}

void SimulationServer::OnPulses(Bus& bus) {
  TellBaud(bus);
  while (const std::optional<Pulse> pulse = bus.lines.Next()) {
    bus.simulator->OnPulse(pulse->line, pulse->low, clock_.Now(), bus.transmit);
  }
}

void SimulationServer::OnPty(Bus& bus, const pollfd& poll, MonoNs now) {
  if ((poll.revents & POLLIN) != 0) {
    TellBaud(bus);
    const std::size_t count = bus.pty.Read(received_);
    if (count > 0) return bus.simulator->OnBytes(Bytes(received_).first(count), now, bus.transmit);
  }
  if ((poll.revents & (POLLHUP | POLLERR)) == 0) return;
  bus.has_host = false;
  bus.pty.Discard();
}

// ---- questions from outside ----

std::string SimulationServer::Answer(Bus& bus, const std::string& text) {
  const Json question = Json::parse(text, nullptr, false);
  if (!question.is_object()) return Json{{"errors", {"the question is no JSON object"}}}.dump();
  return (question.contains("show") ? Show(bus) : Change(bus, question)).dump();
}

Json SimulationServer::Change(Bus& bus, const Json& question) {
  Json errors = Json::array();
  for (const Json& change : question.value("set", Json::array())) {
    const auto words = change.is_array() ? change.get<std::vector<Json>>() : std::vector<Json>();
    const bool usable =
        words.size() == 3 && std::all_of(words.begin(), words.end(), [](const Json& w) { return w.is_string(); });
    const std::string problem = usable
                                    ? bus.simulator->Set(words[0].get<std::string>(), words[1].get<std::string>(),
                                                         words[2].get<std::string>(), clock_.Now())
                                    : "a change is [device, key, value]";
    if (!problem.empty()) errors.push_back(problem);
  }
  if (question.contains("plugged") && question["plugged"].is_boolean()) {
    bus.plugged = question["plugged"].get<bool>();
    bus.has_host = false;
    if (!bus.plugged) bus.pty.Close();
    const std::string problem = bus.plugged ? bus.pty.Open(bus.place.pty) : "";
    if (!problem.empty()) errors.push_back(problem);
  }
  return {{"errors", errors}};
}

Json SimulationServer::Show(const Bus& bus) const {
  Json devices = Json::object();
  for (const std::string& device : bus.place.devices) {
    Json& quantities = devices[device] = Json::object();
    for (const auto& [name, value] : bus.simulator->State(device, clock_.Now())) quantities[name] = Value(value);
  }
  return {{"bus", bus.place.bus},
          {"pty", bus.place.pty},
          {"plugged", bus.plugged},
          {"host", bus.has_host},
          {"devices", devices}};
}

}  // namespace axlecast
