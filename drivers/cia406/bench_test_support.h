#pragma once

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>
#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/config/config_map.h"
#include "drivers/cia406/cia406.h"
#include "drivers/cia406/settings.h"
#include "drivers/cia406/simulator.h"
#include "drivers/kit/arguments.h"
#include "drivers/runtime/bus/bus.h"
#include "tests/support/fake_clock.h"
#include "tests/support/recording_output.h"
#include "tests/support/simulator_frame_link.h"

namespace axlecast::cia406 {

using ByteList = std::vector<std::uint8_t>;

// Returns the settings of a file with these keys; errors go into `errors`.
inline std::shared_ptr<const DeviceSettings> SettingsFrom(const std::string& keys, const BusConfig& bus,
                                                          ConfigErrors& errors) {
  ConfigMap map(YAML::Load("{" + keys + "}"), "", errors);
  std::shared_ptr<const DeviceSettings> settings = ParseDevice(map, bus);
  map.Done();
  return settings;
}

// A CAN bus with these devices; `poll_hz` as in the file.
inline BusConfig BusOf(const std::vector<std::string>& devices, double poll_hz) {
  BusConfig bus;
  bus.name = "can0";
  bus.simulate = true;
  bus.link.bitrate = 250'000;
  bus.poll_hz = poll_hz;
  for (const std::string& keys : devices) {
    DeviceConfig device;
    device.name = std::string(1, static_cast<char>('a' + bus.devices.size()));
    ConfigErrors errors("test.yaml");
    device.settings = SettingsFrom(keys, bus, errors);
    EXPECT_TRUE(errors.empty()) << errors.Text();
    bus.devices.push_back(std::move(device));
  }
  return bus;
}

// The nodes on the bus, and everything that was sent there.
class NodeBus final : public Simulator {
 public:
  explicit NodeBus(const BusConfig& bus, const std::string& simulate) {
    for (const DeviceConfig& device : bus.devices) {
      ConfigErrors errors("test.yaml");
      auto node = MakeNode(device, ConfigMap(YAML::Load("{" + simulate + "}"), "", errors));
      EXPECT_TRUE(errors.empty()) << errors.Text();
      nodes.emplace_back(static_cast<Cia406Node*>(node.release()));
    }
  }

  [[nodiscard]] bool OnFrame(const CanFrame& frame, MonoNs now, const Transmit& transmit) override {
    if (std::none_of(nodes.begin(), nodes.end(), [](const auto& node) { return node->present(); })) return false;
    sent.push_back(frame);
    for (const auto& node : nodes) node->OnFrame(frame, now);
    OnDue(now, transmit);
    return true;
  }
  [[nodiscard]] MonoNs NextDue() const override {
    MonoNs due = intruder_at;
    for (const auto& node : nodes) due = std::min(due, node->NextDue());
    return due;
  }
  void OnDue(MonoNs now, const Transmit& transmit) override {
    for (const auto& node : nodes) node->OnDue(now, [&](const CanFrame& frame) { transmit(ToPacket(frame)); });
    if (now < std::exchange(intruder_at, now < intruder_at ? intruder_at : kNever)) return;
    transmit(ToPacket(intruder));
  }
  [[nodiscard]] Result<> Set(std::string_view, std::string_view, std::string_view, MonoNs) override { return {}; }
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> State(std::string_view, MonoNs) const override {
    return {};
  }

  [[nodiscard]] std::size_t Count(std::uint32_t id) const {
    return static_cast<std::size_t>(
        std::count_if(sent.begin(), sent.end(), [id](const CanFrame& frame) { return frame.id == id; }));
  }

  std::vector<std::unique_ptr<Cia406Node>> nodes;
  std::vector<CanFrame> sent;  // by the host
  CanFrame intruder;           // of another node, once
  MonoNs intruder_at = kNever;
};

// Devices of this model on a bus of simulated nodes, in virtual time.
class BenchTest : public testing::Test, public BusObserver {
 protected:
  void OnLink(bool, std::string_view, MonoNs) override {}

  void Build(const std::vector<std::string>& devices, double poll_hz = 0, const std::string& simulate = "") {
    config_ = BusOf(devices, poll_hz);
    nodes_ = std::make_unique<NodeBus>(config_, simulate);
    link_ = std::make_unique<SimulatorFrameLink>(clock_, *nodes_, config_.link.bitrate);
    BusSettings settings;
    if (poll_hz > 0) settings.schedule.ticks.period = static_cast<MonoNs>(1e9 / poll_hz);
    bus_ = std::make_unique<Bus>(settings, *link_, clock_, *this, nullptr);
    outputs_ = std::vector<RecordingOutput>(devices.size());
    for (std::size_t i = 0; i < devices.size(); ++i) {
      outputs_[i].motion = {.known = true, .standstill = true};
      devices_.push_back(MakeDevice(config_, config_.devices[i], outputs_[i]));
      bus_->Add(*devices_[i]);
    }
  }
  void RunFor(MonoNs time) {
    for (const MonoNs end = clock_.Now() + time; clock_.Now() < end;) bus_->RunOnce(end);
  }
  void Set(std::string_view name, std::string_view value, std::size_t node = 0) {
    nodes_->nodes[node]->Advance(clock_.Now());
    EXPECT_TRUE(nodes_->nodes[node]->Set(name, value)) << name;
  }
  // Begins the command, and runs until its outcome.
  const Outcome& Do(const std::string& command) {
    const CommandLine line = ParseCommandLine(command);
    DriverCommand request{.id = {}, .operation = line.operation, .arguments = line.arguments};
    request.id[0] = ++commands_;
    outputs_[0].outcomes.clear();
    devices_[0]->Begin(request, clock_.Now());
    const MonoNs end = clock_.Now() + 60 * kSecond;
    while (clock_.Now() < end && (output().outcomes.empty() || !output().outcomes.back().second.IsFinal())) {
      bus_->RunOnce(end);
    }
    EXPECT_FALSE(output().outcomes.empty());
    return output().outcomes.back().second;
  }
  // Begins a preset, loses the encoder's answer to its write, and returns the last outcome.
  const Outcome& DoWithLostAnswer(const std::string& operation, const Arguments& arguments) {
    devices_[0]->Begin({.id = {}, .operation = operation, .arguments = arguments}, clock_.Now());
    while (nodes_->Count(0x605) == 0 || nodes_->sent.back().data.data()[0] != 0x23) RunFor(100 * kMicrosecond);
    Set("fault", "off");
    RunFor(10 * kMillisecond);
    Set("fault", "none");
    RunFor(2 * kSecond);
    return output().outcomes.back().second;
  }
  [[nodiscard]] RecordingOutput& output(std::size_t device = 0) { return outputs_[device]; }
  [[nodiscard]] Cia406Node& node(std::size_t index = 0) { return *nodes_->nodes[index]; }
  // Returns the published state of the alarm.
  [[nodiscard]] AlarmState AlarmOf(std::int32_t code) {
    AlarmState state = AlarmState::kAbsent;
    for (const auto& [its, how] : output().alarms) {
      if (its == code) state = how;
    }
    return state;
  }
  [[nodiscard]] std::size_t Errors(ErrorKind kind, std::size_t device = 0) {
    return static_cast<std::size_t>(std::count_if(outputs_[device].errors.begin(), outputs_[device].errors.end(),
                                                  [kind](const auto& error) { return error.first == kind; }));
  }
  // Returns the position of the last sample, turns and single-turn together.
  [[nodiscard]] std::int64_t LastPosition(std::size_t device = 0) {
    const Sample& sample = outputs_[device].samples.back();
    return std::int64_t{sample.turns} << Own(config_.devices[device]).bits | sample.counts;
  }

  FakeClock clock_;
  BusConfig config_;
  std::unique_ptr<NodeBus> nodes_;
  std::unique_ptr<SimulatorFrameLink> link_;
  std::unique_ptr<Bus> bus_;
  std::vector<RecordingOutput> outputs_;
  std::vector<std::unique_ptr<Device>> devices_;
  std::uint8_t commands_ = 0;
};

}  // namespace axlecast::cia406
