#include <gmock/gmock.h>

#include <axlecast/wire_t.hpp>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <string>

#include "drivers/runtime/bus/wire_log.h"
#include "drivers/runtime/process/driver.h"
#include "tests/conformance/example_device.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

std::string TextOf(const Step& step) {
  std::string text = std::to_string(step.action.index()) + ' ' + std::to_string(static_cast<int>(step.priority));
  if (const auto* exchange = std::get_if<Exchange>(&step.action)) {
    for (const std::uint8_t byte : Bytes(exchange->request)) text += ' ' + std::to_string(byte);
  }
  if (const auto* send = std::get_if<Send>(&step.action)) {
    const CanPacket packet = ToPacket(send->frame);
    for (const std::uint8_t byte : Bytes(packet)) text += ' ' + std::to_string(byte);
  }
  if (const auto* listen = std::get_if<Listen>(&step.action)) text += ' ' + std::to_string(listen->until);
  if (const auto* idle = std::get_if<Idle>(&step.action)) text += ' ' + std::to_string(idle->until);
  return text;
}

// Asks its device twice each time and notes when the answers differ.
class AskedTwice final : public Device {
 public:
  explicit AskedTwice(std::unique_ptr<Device> device) : device_(std::move(device)) {}

  [[nodiscard]] Step Next(const BusSlot& turn) const override {
    Step step = device_->Next(turn);
    if (TextOf(step) != TextOf(device_->Next(turn))) ++differing;
    return step;
  }
  void OnStarted(const Step& step, MonoNs now) override { device_->OnStarted(step, now); }
  void On(const Event& event) override { device_->On(event); }
  [[nodiscard]] Result<> Validate(const DriverCommand& order, MonoNs now) const override {
    return device_->Validate(order, now);
  }
  void Begin(const DriverCommand& order, MonoNs now) override { device_->Begin(order, now); }
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs now) override { return device_->Cancel(id, now); }

  mutable int differing = 0;

 private:
  std::unique_ptr<Device> device_;
};

class DeviceConformance : public ExampleTest {
 protected:
  void SetUp() override { ASSERT_TRUE(simulator_); }
  [[nodiscard]] std::unique_ptr<Device> Make(std::size_t index, DeviceOutput& output) {
    return bus_->family->make_device(*bus_, bus_->devices[index], output, secrets_);
  }
};

TEST_P(DeviceConformance, AskingChangesNothing) {
  FakeClock clock;
  ExampleLink link(*bus_, clock, *simulator_);
  Indifferent observer;
  Bus bus = link.MakeBus(clock, observer, nullptr);
  RecordingOutput output = AtRest();
  std::vector<std::unique_ptr<AskedTwice>> devices;
  for (std::size_t i = 0; i < bus_->devices.size(); ++i) {
    devices.push_back(std::make_unique<AskedTwice>(Make(i, output)));
    bus.Add(*devices.back());
  }
  const MonoNs end = clock.Now() + 10 * kSecond;
  while (clock.Now() < end) bus.RunOnce(end);
  for (const auto& device : devices) EXPECT_EQ(device->differing, 0);
  EXPECT_GT(output.samples.size() + output.motors.size(), 1U);
}

TEST_P(DeviceConformance, WithoutALinkItWantsNothing) {
  RecordingOutput output = AtRest();
  const auto device = Make(0, output);
  const BusSlot turn{.now = 1'000 * kSecond, .poll_due = true};
  EXPECT_TRUE(std::holds_alternative<Idle>(device->Next(turn).action));
  device->On(
      {.kind = Event::Kind::kLinkUp, .sent = {}, .received = {turn.now, turn.now}, .request = {}, .bytes = {}});
  device->On(
      {.kind = Event::Kind::kLinkDown, .sent = {}, .received = {turn.now, turn.now}, .request = {}, .bytes = {}});
  EXPECT_TRUE(std::holds_alternative<Idle>(device->Next(turn).action));
}

// A recording, handed to fresh devices, gives the same readings: decoding uses the events alone.
TEST_P(DeviceConformance, ARecordingDecodesToTheSameReadings) {
  FakeClock clock;
  ExampleLink link(*bus_, clock, *simulator_);
  Indifferent observer;
  Timebase time;
  time.Update(clock.Now(), clock.UtcMicroseconds());
  MemorySink sink;
  WireLog log(bus_->name, Origin{.boot_id = 1}, time, sink, WireKindOf(*bus_));
  Bus bus = link.MakeBus(clock, observer, &log);
  std::vector<RecordingOutput> live(bus_->devices.size(), AtRest());
  std::vector<RecordingOutput> again = live;
  std::vector<std::unique_ptr<Device>> devices;
  std::vector<std::unique_ptr<Device>> fresh;
  for (std::size_t i = 0; i < live.size(); ++i) {
    devices.push_back(Make(i, live[i]));
    fresh.push_back(Make(i, again[i]));
    bus.Add(*devices.back());
  }
  const MonoNs end = clock.Now() + 20 * kSecond;
  while (clock.Now() < end) bus.RunOnce(end);
  log.Flush();

  WireReader reader;
  for (const wire_t& message : sink.All<wire_t>("WIRE/" + bus_->name)) {
    reader.Read(message, [&](const Event& event) {
      for (std::size_t i = 0; i < fresh.size(); ++i) {
        if (event.device < 0 || static_cast<std::size_t>(event.device) == i) fresh[i]->On(event);
      }
    });
  }
  EXPECT_EQ(reader.unreadable(), 0);
  for (std::size_t i = 0; i < live.size(); ++i) {
    ASSERT_EQ(again[i].samples.size(), live[i].samples.size());
    for (std::size_t k = 0; k < live[i].samples.size(); ++k) {
      EXPECT_EQ(again[i].samples[k].at, live[i].samples[k].at);
      EXPECT_EQ(again[i].samples[k].counts, live[i].samples[k].counts);
      EXPECT_EQ(again[i].samples[k].turns, live[i].samples[k].turns);
    }
    ASSERT_EQ(again[i].motors.size(), live[i].motors.size());
    for (std::size_t k = 0; k < live[i].motors.size(); ++k) {
      EXPECT_EQ(again[i].motors[k].analog_at, live[i].motors[k].analog_at);
      EXPECT_EQ(again[i].motors[k].voltage_v, live[i].motors[k].voltage_v);
      EXPECT_EQ(again[i].motors[k].status_bits, live[i].motors[k].status_bits);
    }
  }
}

TEST_P(DeviceConformance, ItsFamilyListsItsAlarms) {
  FakeClock clock;
  ExampleLink link(*bus_, clock, *simulator_);
  Indifferent observer;
  Bus bus = link.MakeBus(clock, observer, nullptr);
  std::vector<RecordingOutput> outputs(bus_->devices.size(), AtRest());
  std::vector<std::unique_ptr<Device>> devices;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    devices.push_back(Make(i, outputs[i]));
    bus.Add(*devices.back());
  }
  const MonoNs end = clock.Now() + 10 * kSecond;
  while (clock.Now() < end) bus.RunOnce(end);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    std::set<std::string> names;
    std::set<std::int32_t> codes;
    if (bus_->family->alarms != nullptr) {
      for (const AlarmSpec& alarm : bus_->family->alarms(bus_->devices[i])) {
        EXPECT_TRUE(names.insert(alarm.name).second) << alarm.name;
        EXPECT_TRUE(codes.insert(alarm.code).second) << alarm.name;
        EXPECT_GE(alarm.code, 0x100) << alarm.name;
        EXPECT_LE(std::string(alarm.name).size(), 24U);
        EXPECT_LE(std::string(alarm.action).size(), 80U) << alarm.name;
      }
    }
    for (const auto& [code, alarm] : outputs[i].alarm_specs) EXPECT_TRUE(names.contains(alarm.name)) << alarm.name;
  }
}

TEST_P(DeviceConformance, DecodingTakesAnyBytes) {
  std::mt19937 random(11);
  for (int i = 0; i < 20'000; ++i) {
    std::vector<std::uint8_t> bytes(random() % 40);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
    const auto json = bus_->family->decode({}, bytes);
    ASSERT_TRUE(json ? json->is_object() && json->contains("ok") : !json.error().text.empty());
  }
}

TEST_P(DeviceConformance, TheSimulatorNamesWhatItCannotSet) {
  const std::string& device = bus_->devices[0].name;
  simulator_->OnDue(kSecond, [](Bytes) {});
  EXPECT_NE(ErrorText(simulator_->Set(device, "no_such_key", "1", kSecond)), "");
  EXPECT_NE(ErrorText(simulator_->Set("nobody", "fault", "none", kSecond)), "");
  EXPECT_NE(ErrorText(simulator_->Set(device, "fault", "no_such_fault", kSecond)), "");
  EXPECT_EQ(ErrorText(simulator_->Set(device, "fault", "none", kSecond)), "");
  EXPECT_FALSE(simulator_->State(device, kSecond).empty());
}

INSTANTIATE_TEST_SUITE_P(Family, DeviceConformance, testing::ValuesIn(ExampleBuses()), NameOf);

}  // namespace
}  // namespace axlecast
