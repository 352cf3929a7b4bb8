#pragma once

#include <memory>
#include <optional>
#include <string>

#include "tests/conformance/example_buses.h"
#include "tests/conformance/example_link.h"
#include "tests/support/recording_output.h"

namespace axlecast {

class Indifferent final : public BusObserver {
  void OnLink(bool, std::string_view, MonoNs) override {}
};

// A shaft that stands still, as far as the device can measure.
[[nodiscard]] inline RecordingOutput AtRest() {
  RecordingOutput output;
  output.motion = {.known = true, .standstill = true};
  return output;
}

// The first device of an example bus on its simulator, given orders by hand.
class ExampleDevice {
 public:
  ExampleDevice(const MachineConfig& machine, const BusConfig& bus, SecretSource& secrets)
      : config(bus), simulator_(Simulate(machine, bus)), link_(bus, clock, *simulator_) {
    device = bus.family->make_device(bus, bus.devices.front(), output, secrets);
    bus_ = std::make_unique<Bus>(link_.MakeBus(clock, observer_, nullptr));
    bus_->Add(*device);
  }

  void Run(MonoNs time) {
    for (const MonoNs end = clock.Now() + time; clock.Now() < end;) bus_->RunOnce(end);
  }
  void TellLink(Event::Kind kind) {
    const Interval at{clock.Now(), clock.Now()};
    device->On({.kind = kind, .sent = {}, .received = at, .request = {}, .bytes = {}});
  }
  [[nodiscard]] DriverCommand MakeOrder(std::string_view operation, Arguments arguments) {
    DriverCommand order;
    order.id.back() = ++orders_;
    order.operation = operation;
    order.arguments = std::move(arguments);
    return order;
  }
  // The final outcome that Begin gave at once; nothing when the order was taken up.
  [[nodiscard]] std::optional<Outcome> Begin(const DriverCommand& order) {
    const std::size_t before = output.outcomes.size();
    device->Begin(order, clock.Now());
    if (output.outcomes.size() == before || !output.outcomes.back().second.IsFinal()) return std::nullopt;
    return output.outcomes.back().second;
  }
  [[nodiscard]] int FinalOutcomes(const CommandId& id) const {
    int count = 0;
    for (const auto& [whose, outcome] : output.outcomes) count += whose == id && outcome.IsFinal() ? 1 : 0;
    return count;
  }
  // Until the order has its outcome.
  void Finish(const CommandId& id) {
    constexpr MonoNs kPatience = 120 * kSecond;
    for (const MonoNs end = clock.Now() + kPatience; clock.Now() < end && FinalOutcomes(id) == 0;) {
      Run(100 * kMillisecond);
    }
    Run(kSecond);
  }

  const BusConfig& config;
  FakeClock clock;
  RecordingOutput output = AtRest();
  std::unique_ptr<Device> device;

 private:
  [[nodiscard]] static std::unique_ptr<Simulator> Simulate(const MachineConfig& machine, const BusConfig& bus) {
    ConfigErrors errors("example.yaml");
    return MakeSimulator(machine, bus, errors);
  }

  Indifferent observer_;
  std::unique_ptr<Simulator> simulator_;
  ExampleLink link_;
  std::unique_ptr<Bus> bus_;
  std::uint8_t orders_ = 0;
};

}  // namespace axlecast
