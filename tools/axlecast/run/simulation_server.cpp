#include "tools/axlecast/run/simulation_server.h"

#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>
#include <span>

#include "core/messages/json/field.h"
#include "drivers/hal/simulated_can.h"
#include "drivers/hal/simulated_spi.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/run/simulated_interface.h"
#include "tools/axlecast/run/simulated_pty.h"

namespace axlecast {
namespace {

using Json = nlohmann::ordered_json;

// Numbers stay numbers.
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

SimulationServer::SimulationServer(const Clock& clock) : clock_(clock) {}

std::string SimulationServer::Add(BusPlace place, std::unique_ptr<Simulator> simulator) {
  auto bus = std::make_unique<Bus>();
  bus->place = std::move(place);
  bus->simulator = std::move(simulator);
  if (std::string held = bus->lock.Acquire(bus->place.lock); !held.empty()) {
    return "bus " + bus->place.bus + " is simulated already: " + held;
  }
  bus->port = MakePort(bus->place, *bus->simulator, clock_);
  if (std::string problem = bus->port->Plug(); !problem.empty()) return problem;
  if (!bus->place.lines.empty()) {
    if (std::string problem = bus->lines.Listen(bus->place.lines); !problem.empty()) return problem;
  }
  if (std::string problem = bus->control.Listen(bus->place.control); !problem.empty()) return problem;
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

// The stop event, then of each bus its port, its lines and its control socket.
void SimulationServer::FillPolls(std::vector<pollfd>& polls) const {
  polls.assign(1, {stop_.FileDescriptor(), POLLIN, 0});
  for (const auto& bus : buses_) {
    polls.push_back({bus->port->FileDescriptor(), POLLIN, 0});
    polls.push_back({bus->lines.FileDescriptor(), POLLIN, 0});
    polls.push_back({bus->control.FileDescriptor(), POLLIN, 0});
  }
}

std::string SimulationServer::Run() {
  if (!stop_.valid()) return std::string("cannot create an event: ") + std::strerror(errno);
  prctl(PR_SET_TIMERSLACK, 1UL);
  std::vector<pollfd> polls;
  while (true) {
    FillPolls(polls);
    if (PollUntil(polls, NextDue(), clock_) < 0) return std::string("cannot wait: ") + std::strerror(errno);
    if (polls[0].revents != 0) return {};
    for (std::size_t i = 0; i < buses_.size(); ++i) ServeBus(*buses_[i], std::span(polls).subspan(1 + 3 * i, 3));
  }
}

void SimulationServer::ServeBus(Bus& bus, std::span<const pollfd> polls) {
  const MonoNs now = clock_.Now();
  if (bus.simulator->NextDue() <= now) {
    bus.port->TellBaud();
    bus.simulator->OnDue(now, [&bus](Bytes bytes) { bus.port->Transmit(bytes); });
  }
  if (polls[0].revents != 0 || bus.port->NextDue() <= now) bus.port->Serve();
  if (polls[1].revents != 0) OnPulses(bus);
  if (polls[2].revents != 0) bus.control.Serve([&](const std::string& question) { return Answer(bus, question); });
}

void SimulationServer::OnPulses(Bus& bus) {
  bus.port->Serve();  // what came before the pulse, if only the host itself
  bus.port->TellBaud();
  while (const std::optional<Pulse> pulse = bus.lines.Next()) {
    bus.simulator->OnPulse(pulse->line, pulse->low, clock_.Now(), [&bus](Bytes b) { bus.port->Transmit(b); });
  }
}

// ---- questions from outside ----

std::string SimulationServer::Answer(Bus& bus, const std::string& text) {
  const Json question = ParseOutsideJson(text);
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
    if (!bus.plugged) bus.port->Unplug();
    const std::string problem = bus.plugged ? bus.port->Plug() : "";
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
          {"port", bus.place.interface.empty() ? bus.place.port : bus.place.interface},
          {"plugged", bus.plugged},
          {"host", bus.port->HasHost()},
          {"devices", devices}};
}

}  // namespace axlecast
