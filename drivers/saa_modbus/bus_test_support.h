#pragma once

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>
#include <algorithm>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"
#include "drivers/kit/arguments.h"
#include "drivers/runtime/bus/bus.h"
#include "drivers/saa_modbus/codec.h"
#include "drivers/saa_modbus/family.h"
#include "drivers/saa_modbus/settings.h"
#include "tests/support/fake_clock.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/recording_output.h"
#include "tests/support/simulator_link.h"

namespace axlecast::saa_modbus {

using ByteList = std::vector<std::uint8_t>;

// The line to the simulator: notes what is written and at which rate, and refuses a rate that its port cannot do.
class WatchedLink final : public ByteLink {
 public:
  WatchedLink(FakeClock& clock, Simulator& simulator, std::int64_t baud)
      : clock_(clock), link_(clock, simulator, baud), baud_(baud) {}

  void RefuseBaud(std::int64_t baud) { refused_ = baud; }
  void Unplug() { link_.Unplug(); }
  void Plug() { link_.Plug(); }
  [[nodiscard]] std::int64_t baud() const { return baud_; }
  [[nodiscard]] const std::vector<ByteList>& written() const { return written_; }
  // From the last of these changes to the request after it.
  [[nodiscard]] MonoNs rest() const { return rest_; }
  // Requests that change something in an encoder.
  [[nodiscard]] std::vector<ByteList> Changes() const {
    std::vector<ByteList> changes;
    std::copy_if(written_.begin(), written_.end(), std::back_inserter(changes), ChangesSomething);
    return changes;
  }

  [[nodiscard]] Result<> Open() override { return link_.Open(); }
  void Close() override { link_.Close(); }
  [[nodiscard]] bool IsOpen() const override { return link_.IsOpen(); }
  [[nodiscard]] bool SetBaud(std::int64_t baud) override {
    if (baud == refused_ || !link_.SetBaud(baud)) return false;
    baud_ = baud;
    return true;
  }
  [[nodiscard]] bool Write(Bytes bytes) override {
    if (!written_.empty() && ChangesSomething(written_.back())) rest_ = clock_.Now() - written_at_;
    written_.emplace_back(bytes.begin(), bytes.end());
    written_at_ = clock_.Now();
    return link_.Write(bytes);
  }
  [[nodiscard]] ReadResult Read(std::span<std::uint8_t> into, MonoNs deadline) override {
    return link_.Read(into, deadline);
  }
  [[nodiscard]] ReadResult ReadNow(std::span<std::uint8_t> into) override { return link_.ReadNow(into); }
  [[nodiscard]] Status Wait(MonoNs until) override { return link_.Wait(until); }
  void Wake() override {}
  [[nodiscard]] LineErrors Errors() const override { return link_.Errors(); }

 private:
  static bool ChangesSomething(const ByteList& request) { return request[1] == 0xA1 || request[1] == 0xCC; }

  const Clock& clock_;
  SimulatorLink link_;
  std::int64_t baud_;
  std::int64_t refused_ = 0;
  std::vector<ByteList> written_;
  MonoNs written_at_ = 0;
  MonoNs rest_ = 0;
};

// What one device hands out, and its standstill as its last readings show it.
class Watch final : public RecordingOutput {
 public:
  [[nodiscard]] Motion MotionAt(MonoNs now) const override {
    Motion seen;
    if (samples.size() < 3 || now - samples.back().at.last > 300 * kMillisecond) return seen;
    seen.known = true;
    seen.standstill = true;
    for (std::size_t i = samples.size() - 3; i < samples.size(); ++i) {
      seen.standstill = seen.standstill && std::abs(samples[i].counts - samples.back().counts) <= 3;
    }
    seen.speed_rpm = seen.standstill ? 0 : 10;
    return seen;
  }
  [[nodiscard]] int Count(ErrorKind kind) const {
    return static_cast<int>(
        std::count_if(errors.begin(), errors.end(), [&](const auto& e) { return e.first == kind; }));
  }
  [[nodiscard]] int FinalOutcomes() const {
    return static_cast<int>(
        std::count_if(outcomes.begin(), outcomes.end(), [](const auto& o) { return o.second.IsFinal(); }));
  }
};

// A bus of devices as a file describes it, their simulator, and the runtime's own bus between them.
class Machine final : public BusObserver {
 public:
  // `devices`: "axis1: {bits: 16, ...}, axis2: ..."; `simulate` likewise.
  explicit Machine(const std::string& devices = "axis1: {bits: 16}", const std::string& simulate = "",
                   std::int64_t baud = 19'200, MonoNs late = 0) {
    config_.late = late;
    ConfigErrors errors("test.yaml");
    ConfigMap map(YAML::Load("{link: {baud: " + std::to_string(baud) + "}, devices: {" + devices +
                             "}, simulate: {" + simulate + "}}"),
                  "bus", errors);
    config_.name = "rs485-0";
    config_.link.line.baud = baud;
    config_.simulate = true;
    config_.poll_hz = 0;
    config_.family_bus = ParseBus(map, config_);
    for (auto& [name, keys] : map.Maps("devices")) {
      DeviceConfig device;
      device.name = name;
      device.settings = ParseSettings(keys, config_);
      keys.Done();
      config_.devices.push_back(std::move(device));
    }
    CheckBus(map, config_);
    ConfigMap simulated = map.Map("simulate");
    simulator_ = saa_modbus_family().make_simulator(config_, simulated);
    simulated.Done();
    EXPECT_TRUE(errors.empty()) << errors.Text();
    port = std::make_unique<WatchedLink>(clock, *simulator_, baud);
    Start();
  }

  // A new driver process on the same line.
  void Start() {
    BusSettings settings;
    settings.late = config_.late;
    settings.schedule.pacing = config_.family_bus->pacing;
    settings.schedule.line = config_.link.line;
    settings.schedule.ticks.period = 0;
    devices_.clear();
    bus_ = std::make_unique<Bus>(settings, *port, clock, *this, nullptr);
    for (const DeviceConfig& device : config_.devices) {
      Watch& output = outputs[device.name];
      devices_.push_back(MakeDevice(config_, device, output, secrets_));
      bus_->Add(*devices_.back());
    }
  }

  void Run(MonoNs duration) {
    for (const MonoNs end = clock.Now() + duration; clock.Now() < end;) (void)bus_->RunOnce(end);
  }
  // Returns false if `holds` never becomes true.
  [[nodiscard]] bool RunUntil(const std::function<bool()>& holds, MonoNs maximum = 10 * kSecond) {
    for (const MonoNs end = clock.Now() + maximum; clock.Now() < end && !holds();) Run(kMillisecond);
    return holds();
  }
  // Until the command has begun and its next request is the one that changes the encoder.
  void RunToTheChange() {
    EXPECT_TRUE(RunUntil([&] { return !output().outcomes.empty() && !output().outcomes.back().second.IsFinal(); }));
    EXPECT_TRUE(port->Changes().empty());
  }
  void RunThroughTheChange() {
    EXPECT_TRUE(RunUntil([&] { return port->Changes().size() == 1; }));
  }
  void Set(const std::string& device, const std::string& key, const std::string& value) {
    EXPECT_EQ(ErrorText(simulator_->Set(device, key, value, clock.Now())), "");
  }
  [[nodiscard]] Watch& output(std::size_t index = 0) { return outputs[config_.devices.at(index).name]; }
  // Returns a quantity or a counter of a simulated encoder.
  [[nodiscard]] std::string State(const std::string& key, std::size_t index = 0) const {
    for (const auto& [name, value] : simulator_->State(config_.devices.at(index).name, clock.Now())) {
      if (name == key) return value;
    }
    return "absent";
  }
  [[nodiscard]] Device& device(std::size_t index = 0) { return *devices_.at(index); }

  void Begin(const std::string& operation, Arguments arguments = {}, std::size_t index = 0) {
    DriverCommand command;
    command.id = {1, 2, 3};
    command.operation = operation;
    command.arguments = std::move(arguments);
    device(index).Begin(command, clock.Now());
  }
  // Until the command has its one outcome.
  Outcome Finish(std::size_t index = 0, MonoNs maximum = 30 * kSecond) {
    const MonoNs end = clock.Now() + maximum;
    while (clock.Now() < end && output(index).FinalOutcomes() == finished_) Run(kMillisecond);
    EXPECT_EQ(output(index).FinalOutcomes(), finished_ + 1);
    finished_ = output(index).FinalOutcomes();
    return output(index).outcomes.empty() ? Outcome{} : output(index).outcomes.back().second;
  }
  Outcome Do(const std::string& operation, Arguments arguments = {}, std::size_t index = 0) {
    finished_ = output(index).FinalOutcomes();
    Begin(operation, std::move(arguments), index);
    return Finish(index);
  }
  [[nodiscard]] AlarmState Alarm() {
    return output().alarms.empty() ? AlarmState::kAbsent : output().alarms.back().second;
  }

  void OnLink(bool, std::string_view, MonoNs) override {}

  FakeClock clock;
  std::map<std::string, Watch> outputs;
  std::unique_ptr<WatchedLink> port;

 private:
  BusConfig config_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<Bus> bus_;
  FixedSecrets secrets_;
  std::vector<std::unique_ptr<Device>> devices_;
  int finished_ = 0;
};

// Returns the change of this key; empty if the outcome has no such change.
inline Change ChangeOf(const Outcome& outcome, const std::string& key) {
  for (const Change& change : outcome.changes) {
    if (change.key == key) return change;
  }
  return {};
}

}  // namespace axlecast::saa_modbus
