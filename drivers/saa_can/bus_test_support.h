#pragma once

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>
#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/config/config_map.h"
#include "drivers/kit/arguments.h"
#include "drivers/runtime/bus/bus.h"
#include "drivers/runtime/process/driver.h"
#include "drivers/saa_can/machine_test_support.h"
#include "drivers/saa_can/settings.h"
#include "tests/support/fake_clock.h"
#include "tests/support/recording_output.h"
#include "tests/support/simulator_frame_link.h"

namespace axlecast::saa_can {

// The bus to the simulator: records what the driver sends, and injects frames of another node.
class WatchedFrames final : public FrameLink {
 public:
  WatchedFrames(FakeClock& clock, Simulator& simulator, std::int64_t bitrate)
      : clock_(clock), link_(clock, simulator, bitrate) {}

  // Makes a frame of another node arrive now.
  void Inject(const CanFrame& frame) { injected_.push_back(frame); }
  void Unplug() { link_.Unplug(); }
  void Plug() { link_.Plug(); }
  void FillQueue(bool full) { full_ = full; }
  [[nodiscard]] const std::vector<CanFrame>& sent() const { return sent_; }
  [[nodiscard]] int Sent(std::uint32_t id, std::uint8_t code) const {
    return static_cast<int>(std::count_if(sent_.begin(), sent_.end(), [&](const CanFrame& frame) {
      return frame.id == id && Bytes(frame.data)[0] == code;
    }));
  }

  [[nodiscard]] Result<> Open() override { return link_.Open(); }
  void Close() override { link_.Close(); }
  [[nodiscard]] bool IsOpen() const override { return link_.IsOpen(); }
  [[nodiscard]] SendResult Send(const CanFrame& frame) override {
    if (full_) return SendResult::kFull;
    sent_.push_back(frame);
    return link_.Send(frame);
  }
  [[nodiscard]] Status Receive(Received& received) override {
    if (injected_.empty()) return link_.Receive(received);
    received = {.frame = injected_.front(), .at = {clock_.Now(), clock_.Now()}, .own = false};
    injected_.erase(injected_.begin());
    return Status::kOk;
  }
  [[nodiscard]] CanController Controller() override { return link_.Controller(); }
  [[nodiscard]] Status Wait(MonoNs until) override { return link_.Wait(until); }
  void Wake() override {}
  [[nodiscard]] LineErrors Errors() const override { return {}; }

 private:
  FakeClock& clock_;
  SimulatorFrameLink link_;
  std::vector<CanFrame> sent_;
  std::vector<CanFrame> injected_;
  bool full_ = false;
};

// A whole bus in virtual time: simulator, runtime's bus, and one device for each entry of `devices`.
class SimulatedBus : BusObserver, SecretSource {
 public:
  explicit SimulatedBus(const std::string& devices, const std::string& simulate = "",
                        const std::string& keys = kSimulated, std::int64_t host_bitrate = 0)
      : machine_(LoadMachine(keys, devices)) {
    BusConfig& config = machine_.buses.at(0);
    ConfigErrors errors("simulate.yaml");
    ConfigMap map(YAML::Load("{" + simulate + "}"), "simulate", errors);
    simulator_ = config.family->make_simulator(config, map);
    EXPECT_TRUE(errors.empty()) << errors.Text();
    frames =
        std::make_unique<WatchedFrames>(clock, *simulator_, host_bitrate != 0 ? host_bitrate : config.link.bitrate);
    BusObserver& observer = *this;
    bus_ = std::make_unique<Bus>(BusSettingsOf(config, nullptr), *frames, clock, observer, nullptr);
    for (const DeviceConfig& device : config.devices) {
      RecordingOutput& output = outputs[device.name];
      output.motion = {.known = true, .standstill = true};
      made_.push_back(config.family->make_device(config, device, output, *this));
      bus_->Add(*made_.back());
    }
  }

  void Run(MonoNs duration) {
    for (const MonoNs end = clock.Now() + duration; clock.Now() < end;) bus_->RunOnce(end);
  }
  void Set(const std::string& device, const std::string& key, const std::string& value) {
    EXPECT_EQ(ErrorText(simulator_->Set(device, key, value, clock.Now())), "");
  }
  [[nodiscard]] std::string State(const std::string& device, const std::string& key) const {
    for (const auto& [name, value] : simulator_->State(device, clock.Now())) {
      if (name == key) return value;
    }
    return "";
  }
  void Begin(const std::string& operation, Arguments arguments = {}, MonoNs begin_by = kNever) {
    DriverCommand command;
    command.id = {1};
    command.operation = operation;
    command.arguments = std::move(arguments);
    command.begin_by = begin_by;
    made_.at(0)->Begin(command, clock.Now());
  }
  // Runs until the final outcome.
  Outcome Finish(MonoNs maximum = 30 * kSecond) {
    const auto over = [this] { return !output().outcomes.empty() && output().outcomes.back().second.IsFinal(); };
    for (const MonoNs end = clock.Now() + maximum; clock.Now() < end && !over();) Run(kMillisecond);
    EXPECT_TRUE(over());
    return over() ? output().outcomes.back().second : Outcome{};
  }
  Outcome Do(const std::string& operation, Arguments arguments = {}) {
    output().outcomes.clear();
    Begin(operation, std::move(arguments));
    return Finish();
  }
  [[nodiscard]] int Errors(ErrorKind kind, const std::string& device = "a") {
    const auto& errors = outputs[device].errors;
    return static_cast<int>(
        std::count_if(errors.begin(), errors.end(), [&](const auto& error) { return error.first == kind; }));
  }
  RecordingOutput& output() { return outputs["a"]; }

  FakeClock clock;
  std::map<std::string, RecordingOutput> outputs;
  std::unique_ptr<WatchedFrames> frames;

 private:
  void OnLink(bool, std::string_view, MonoNs) override {}
  [[nodiscard]] Result<Secret> Read(const SecretPlace&) override { return Failure("no secrets here"); }

  MachineConfig machine_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<Bus> bus_;
  std::vector<std::unique_ptr<Device>> made_;
};

// Returns the value of this change; empty if the outcome does not have it.
inline std::string After(const Outcome& outcome, const std::string& key) {
  for (const Change& change : outcome.changes) {
    if (change.key == key) return change.after;
  }
  return "";
}

}  // namespace axlecast::saa_can
