#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/config/config_map.h"
#include "drivers/biss/family.h"
#include "drivers/biss/settings.h"
#include "tests/support/machine_text.h"
#include "tests/support/recording_output.h"

namespace axlecast::biss {

// A machine with one simulated bus, `keys` of the bus and of its encoder `a`.
inline std::string MachineText(const std::string& bus_keys, const std::string& keys) {
  return "machine: test\nbuses:\n  b: {family: biss, simulate: true" + (bus_keys.empty() ? "" : ", " + bus_keys) +
         ", devices: {a: {" + keys + "}}}\n";
}

// The machine as the driver would have it. Fails the test when the text is refused.
inline MachineConfig LoadMachine(const std::string& bus_keys, const std::string& keys) {
  return MachineFromText(MachineText(bus_keys, keys));
}

// The errors; empty if there are none.
inline std::string ProblemOf(const std::string& bus_keys, const std::string& keys) {
  return ErrorsOfText(MachineText(bus_keys, keys));
}

// Driver and simulator in virtual time, without a bus between them: each transfer takes its clocks, and the next one
// follows after the pause that the family asks for.
class Rig : SecretSource {
 public:
  Rig(const std::string& bus_keys, const std::string& keys, const std::string& simulate)
      : machine_(LoadMachine(bus_keys, keys)) {
    ConfigErrors errors("machine.yaml");
    ConfigMap map(YAML::Load("{a: {" + simulate + "}}"), "simulate", errors);
    simulator_ = MakeBissSimulator(machine_.buses.at(0), map);
    EXPECT_TRUE(simulator_) << errors.Text();
    device_ = MakeDevice(machine_.buses[0], machine_.buses[0].devices.at(0), output, *this);
    if (simulator_) simulator_->OnDue(now, [](Bytes) {});
    Tell(Event::Kind::kLinkUp, {});
  }

  [[nodiscard]] const BissSettings& settings() const { return Own(machine_.buses[0].devices[0]); }
  [[nodiscard]] const BissBus& bus() const { return OwnBus(machine_.buses[0]); }
  [[nodiscard]] Device& device() { return *device_; }
  [[nodiscard]] Step Next(bool poll_due = true) const { return device_->Next({.now = now, .poll_due = poll_due}); }

  // One reading, `setup` after the pause: the time that the host takes before and after the transfer itself.
  void Read(MonoNs setup = 3 * kMicrosecond, bool poll_due = true) {
    const Step step = Next(poll_due);
    const auto* exchange = std::get_if<Exchange>(&step.action);
    ASSERT_NE(exchange, nullptr);
    device_->OnStarted(step, now);
    std::vector<std::uint8_t> rx(exchange->request.size());
    ASSERT_EQ(exchange->reply_length(rx), rx.size());
    const SpiTransfer transfer{.settings = settings().spi, .tx = exchange->request};
    latest_edge = now + setup;
    simulator_->OnTransfer(transfer, latest_edge, rx);
    const Interval sent{
        now, latest_edge + transfer.settings.ClockTime(static_cast<std::int64_t>(8 * rx.size())) + setup};
    now = sent.last;
    last_rx = rx;
    device_->On({.kind = Event::Kind::kReply,
                 .sent = sent,
                 .received = {now, now},
                 .request = exchange->request,
                 .bytes = rx});
    now += bus().pacing.after_reply;
  }
  void ReadTimes(int times) {
    for (int i = 0; i < times; ++i) Read();
  }
  void Tell(Event::Kind kind, Bytes bytes) {
    device_->On({.kind = kind, .sent = {now, now}, .received = {now, now}, .request = {}, .bytes = bytes});
  }
  [[nodiscard]] std::string Set(const std::string& key, const std::string& value) {
    return ErrorText(simulator_->Set("a", key, value, now));
  }
  [[nodiscard]] std::string Shown(const std::string& key) const {
    for (const auto& [name, value] : simulator_->State("a", now)) {
      if (name == key) return value;
    }
    return "absent";
  }
  // The complaints that there are, "early 1".
  [[nodiscard]] std::string Complaints() const {
    std::string text;
    for (const char* name :
         {"wrong_mode", "wrong_words", "fast_clock", "slow_clock", "early", "cut", "near_edges"}) {
      if (Shown(name) != "0") text += std::string(text.empty() ? "" : ", ") + name + ' ' + Shown(name);
    }
    return text;
  }
  // The errors so far, by name.
  [[nodiscard]] std::vector<std::string> Errors() const {
    std::vector<std::string> names;
    for (const auto& [kind, at] : output.errors) names.emplace_back(ErrorName(kind));
    return names;
  }

  MonoNs now = 1'000 * kSecond;
  MonoNs latest_edge = 0;  // the clock's first edge of the last transfer
  std::vector<std::uint8_t> last_rx;
  RecordingOutput output;

 private:
  MachineConfig machine_;
  [[nodiscard]] Result<Secret> Read(const SecretPlace&) override { return Failure("no secrets here"); }

  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<Device> device_;
};

}  // namespace axlecast::biss
