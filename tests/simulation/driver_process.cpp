#include "tests/simulation/driver_process.h"

#include <axlecast/motor_health_t.hpp>
#include <stdexcept>
#include <utility>

namespace axlecast::simulation {
namespace {

// Returns "axis1" of "POSITION/axis1"; empty for another kind of channel.
std::string DeviceOf(const std::string& channel, std::string_view kind) {
  return channel.starts_with(kind) ? channel.substr(kind.size()) : "";
}

}  // namespace

DriverProcess::DriverProcess(const MachineConfig& machine, const BusConfig& bus, Schedule& schedule, Host& host,
                             Network& network, Promises& promises, std::uint64_t seed)
    : machine_(machine),
      bus_(bus),
      schedule_(schedule),
      host_(host),
      network_(network),
      promises_(promises),
      thread_(schedule, host) {
  ConfigErrors errors("simulation");
  simulator_ = MakeSimulator(machine, bus, errors);
  if (!simulator_) throw std::runtime_error(errors.Text());
  wire_ = MakeWire(bus, schedule, host, thread_, *simulator_, seed);
  secrets_.any = "password";
  if (!bus.family->has_position) return;
  for (const DeviceConfig& device : bus.devices) {
    truths_.emplace(device.name, ShaftTruth(device, *simulator_))
        .first->second.Disturb(host.clock.Now() + 2 * kSecond);
  }
}

void DriverProcess::Start() {
  membership_ = network_.Join(host_, Port::kCommands, [this](const std::string& channel, Bytes message) {
    if (driver_ == nullptr) return;
    if (channel == "DRIVER_COMMAND/" + bus_.name) driver_->command_server().OnDriverCommand(message);
    if (channel == "DRIVER_STATUS/" + bus_.name) driver_->duplicates().OnDriverStatus(message);
    if (channel.starts_with("DRIVER_TIME/")) driver_->base_clock().OnTime(message);
  });
  thread_.Start([this] { Run(); });
}

void DriverProcess::Run() {
  HostPort data(network_, host_, Port::kData,
                [this](const std::string& channel, Bytes message) { OnPublished(channel, message); });
  HostPort commands(network_, host_, Port::kCommands);
  DriverPorts ports{.secrets = &secrets_,
                    .clock = &host_.clock,
                    .data = &data,
                    .commands = &commands,
                    .has_time_base = !machine_.time.root.empty(),
                    .log = [](LogLevel, std::string_view) {},
                    .link_warnings = {}};
  wire_->PlugInto(ports);
  Driver driver(bus_, machine_.bridge, host_.NewOrigin(machine_.machine), std::move(ports));
  struct Registered {
    Driver*& place;
    Registered(Driver*& at, Driver* made) : place(at) { place = made; }
    ~Registered() { place = nullptr; }
  } registered(driver_, &driver);
  for (;;) driver.RunOnce();
}

void DriverProcess::Kill() {
  if (membership_ >= 0) network_.Leave(membership_);
  membership_ = -1;
  thread_.Kill();
  wire_->Release();
}

void DriverProcess::Set(const std::string& device, const std::string& key, const std::string& value,
                        MonoNs settles) {
  const MonoNs now = host_.clock.Now();
  if (const Result<> set = simulator_->Set(device, key, value, now); !set) throw std::logic_error(set.error().text);
  const auto truth = truths_.find(device);
  if (truth != truths_.end()) truth->second.Disturb(now + settles);
  wire_->Follow();
}

std::string DriverProcess::Quantity(const std::string& device, const std::string& key) const {
  for (const auto& [name, value] : simulator_->State(device, host_.clock.Now())) {
    if (name == key) return value;
  }
  throw std::logic_error(device + " has no " + key);
}

MonoNs DriverProcess::last_valid(const std::string& device) const {
  const auto found = valid_.find(device);
  return found == valid_.end() ? 0 : found->second;
}

void DriverProcess::OnPublished(const std::string& channel, Bytes message) {
  if (const std::string device = DeviceOf(channel, "POSITION/"); !device.empty())
    return JudgePosition(device, message);
  const std::string motor = DeviceOf(channel, "MOTOR/");
  if (!motor.empty()) valid_[motor] = schedule_.now();
}

void DriverProcess::JudgePosition(const std::string& device, Bytes message) {
  const auto position = DecodeMessage<position_t>(message);
  if (!position) return promises_.Breach(device + ": a POSITION that cannot be decoded");
  promises_.Count("positions published");
  if ((position->flags & position_t::FLAG_VALID) == 0) return;
  valid_[device] = schedule_.now();
  promises_.Count("valid positions");
  ShaftTruth& truth = truths_.at(device);
  switch (truth.Judge(*position, host_.clock.Now())) {
    case ShaftTruth::Verdict::kTrue:
      return promises_.Count("positions compared with their shaft");
    case ShaftTruth::Verdict::kFalse:
      return promises_.Breach(device + ": " + truth.reason());
    case ShaftTruth::Verdict::kNotJudged:
      return;
  }
}

}  // namespace axlecast::simulation
