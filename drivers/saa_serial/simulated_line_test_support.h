#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/config/config_map.h"
#include "drivers/runtime/bus/bus.h"
#include "drivers/saa_serial/machine_test_support.h"
#include "drivers/saa_serial/settings.h"
#include "tests/support/fake_clock.h"
#include "tests/support/recording_output.h"

namespace axlecast::saa_serial {

// The line to a simulator, in virtual time. An adapter may hold bytes back until the next multiple of `hold`.
class SimulatedLine final : public ByteLink, public PulseLines {
 public:
  SimulatedLine(FakeClock& clock, Simulator& simulator, MonoNs hold)
      : clock_(clock), simulator_(simulator), hold_(hold) {}

  [[nodiscard]] Result<> Open() override {
    open_ = true;
    return {};
  }
  void Close() override { open_ = false; }
  [[nodiscard]] bool IsOpen() const override { return open_; }
  [[nodiscard]] bool SetBaud(std::int64_t) override { return false; }
  [[nodiscard]] bool Write(Bytes bytes) override {
    written.emplace_back(clock_.Now(), std::vector<std::uint8_t>(bytes.begin(), bytes.end()));
    if (drop_ && bytes.size() == 3) return open_ = !std::exchange(drop_, false);
    simulator_.OnBytes(bytes, clock_.Now(), Transmit());
    return open_;
  }
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override {
    if (!open_) return {Status::kLost, 0};
    Sleep(deadline);
    return ReadNow(into);
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override {
    if (!open_) return {Status::kLost, 0};
    Serve(clock_.Now());
    std::size_t count = 0;
    while (count < into.size() && !arrivals_.empty() && arrivals_.begin()->first <= clock_.Now()) {
      into[count++] = arrivals_.begin()->second;
      arrivals_.erase(arrivals_.begin());
    }
    return {count > 0 ? Status::kOk : Status::kTimeout, count};
  }
  [[nodiscard]] Status Wait(MonoNs until) override {
    if (!open_) {
      clock_.MoveTo(std::max(clock_.Now(), until));
      return Status::kTimeout;
    }
    return Sleep(until) ? Status::kOk : Status::kTimeout;
  }
  void Wake() override {}
  [[nodiscard]] LineErrors Errors() const override { return {}; }
  [[nodiscard]] bool Pulse(std::uint8_t line, MonoNs low) override {
    clock_.Advance(low);
    pulses.emplace_back(line, clock_.Now() - low);
    if (!open_) return false;
    simulator_.OnPulse(line, low, clock_.Now(), Transmit());
    return open_ = !std::exchange(drop_, false);
  }

  void LoseAfterNextRequest() { drop_ = true; }
  // The scheduler delays the next read of the driver by this time.
  void Stall(MonoNs time) { clock_.Advance(time); }

  std::vector<std::pair<MonoNs, std::vector<std::uint8_t>>> written;
  std::vector<std::pair<std::uint8_t, MonoNs>> pulses;  // line, falling edge

 private:
  Simulator::Transmit Transmit() {
    return [this](Bytes bytes) {
      const MonoNs now = served_ > 0 ? served_ : clock_.Now();
      const MonoNs at = hold_ == 0 ? now : (now + hold_ - 1) / hold_ * hold_;
      for (const std::uint8_t byte : bytes) arrivals_.emplace(at, byte);
    };
  }
  void Serve(MonoNs until) {
    while (simulator_.NextDue() <= until) {
      served_ = std::max(simulator_.NextDue(), MonoNs{1});
      simulator_.OnDue(served_ == 1 ? clock_.Now() : served_, Transmit());
    }
    served_ = 0;
  }
  // True when bytes are there.
  bool Sleep(MonoNs until) {
    while (true) {
      Serve(clock_.Now());
      const MonoNs next = arrivals_.empty() ? kNever : arrivals_.begin()->first;
      if (next <= clock_.Now()) return true;
      const MonoNs step = std::min({next, simulator_.NextDue(), until});
      if (step >= until && next > until) {
        clock_.MoveTo(std::max(clock_.Now(), until));
        Serve(clock_.Now());
        return !arrivals_.empty() && arrivals_.begin()->first <= clock_.Now();
      }
      clock_.MoveTo(std::max(clock_.Now(), step));
    }
  }

  FakeClock& clock_;
  Simulator& simulator_;
  MonoNs hold_;
  bool open_ = false;
  bool drop_ = false;
  MonoNs served_ = 0;
  std::multimap<MonoNs, std::uint8_t> arrivals_;
};

// A whole bus: simulator, line, the runtime's Bus and one device for each entry of `devices`.
class SimulatedBus : BusObserver, SecretSource {
 public:
  SimulatedBus(const std::string& keys, const std::string& devices, const std::string& simulate = "",
               MonoNs hold = 0, MonoNs late = 0)
      : machine_(LoadMachine(keys, devices)) {
    BusConfig& config = machine_.buses.at(0);
    ConfigErrors errors("simulate.yaml");
    ConfigMap map(YAML::Load("{" + simulate + "}"), "simulate", errors);
    simulator_ = config.family->make_simulator(config, map);
    EXPECT_TRUE(errors.empty()) << errors.Text();
    line = std::make_unique<SimulatedLine>(clock, *simulator_, hold);
    BusSettings settings;
    if (config.poll_hz > 0) settings.schedule.ticks.period = static_cast<MonoNs>(1e9 / config.poll_hz);
    settings.schedule.line = config.link.line;
    settings.echo = config.link.echo;
    settings.late = late;
    settings.lines = line.get();
    BusObserver& observer = *this;
    bus_ = std::make_unique<Bus>(settings, *line, clock, observer, nullptr);
    for (const DeviceConfig& device : config.devices) {
      RecordingOutput& output = outputs[device.name];
      output.motion = {.known = true, .standstill = true};
      made_.push_back(config.family->make_device(config, device, output, *this));
      bus_->Add(*made_.back());
    }
  }

  void Run(MonoNs duration) {
    const MonoNs end = clock.Now() + duration;
    while (clock.Now() < end) bus_->RunOnce(end);
  }
  void Set(const std::string& device, const std::string& key, const std::string& value) {
    EXPECT_EQ(ErrorText(simulator_->Set(device, key, value, clock.Now())), "");
  }
  void Begin(std::size_t device, const std::string& operation,
             std::vector<std::pair<std::string, std::string>> arguments = {}) {
    DriverCommand order;
    order.id = {1};
    order.operation = operation;
    order.arguments = std::move(arguments);
    made_.at(device)->Begin(order, clock.Now());
  }
  // Returns a counter that the simulator shows of a device.
  [[nodiscard]] int Count(const std::string& device, const std::string& name) const {
    for (const auto& [key, value] : simulator_->State(device, clock.Now())) {
      if (key == name) return std::stoi(value);
    }
    ADD_FAILURE() << "no counter " << name;
    return -1;
  }
  [[nodiscard]] Simulator& wire() { return *simulator_; }
  [[nodiscard]] Device& device(std::size_t index = 0) { return *made_.at(index); }
  RecordingOutput& output() { return outputs.begin()->second; }
  [[nodiscard]] std::vector<std::string> FinalTexts(const std::string& device) {
    std::vector<std::string> texts;
    for (const auto& [id, outcome] : outputs[device].outcomes) {
      if (outcome.IsFinal()) texts.push_back(outcome.text);
    }
    return texts;
  }
  [[nodiscard]] std::map<ErrorKind, int> Errors(const std::string& device) {
    std::map<ErrorKind, int> errors;
    for (const auto& [kind, at] : outputs[device].errors) ++errors[kind];
    return errors;
  }

  FakeClock clock;
  std::map<std::string, RecordingOutput> outputs;
  std::unique_ptr<SimulatedLine> line;

 private:
  void OnLink(bool, std::string_view, MonoNs) override {}
  [[nodiscard]] Result<Secret> Read(const SecretPlace&) override { return Failure("no secrets here"); }

  MachineConfig machine_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<Bus> bus_;
  std::vector<std::unique_ptr<Device>> made_;
};

}  // namespace axlecast::saa_serial
