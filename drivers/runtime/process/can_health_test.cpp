// What a driver reports about its CAN bus: alarms on every channel, BUS.

#include <gmock/gmock.h>

#include <axlecast/alarm_t.hpp>
#include <axlecast/bus_health_t.hpp>
#include <memory>
#include <string>
#include <vector>

#include "drivers/runtime/process/driver.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/memory_sink.h"
#include "tests/support/polled_family.h"
#include "tests/support/scripted_frame_link.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using State = CanController::State;

constexpr MonoNs kStart = 1'000 * kSecond;

// Only listens.
class Listener final : public Device {
 public:
  [[nodiscard]] Step Next(const BusSlot& turn) const override { return {.action = Listen{turn.now + kSecond}}; }
  void OnStarted(const Step&, MonoNs) override {}
  void On(const Event&) override {}
  [[nodiscard]] Result<> Validate(const DriverCommand&, MonoNs) const override { return {}; }
  void Begin(const DriverCommand&, MonoNs) override {}
  [[nodiscard]] bool Cancel(const CommandId&, MonoNs) override { return false; }
};

const Family& ListenerFamily() {
  static const Family kFamily = {
      .name = "listener",
      .summary = "listens on a CAN bus",
      .link = LinkKind::kCan,
      .max_devices_per_bus = 16,
      .operations = {},
      .make_device = [](const BusConfig&, const DeviceConfig&, DeviceOutput&,
                        SecretSource&) -> std::unique_ptr<Device> { return std::make_unique<Listener>(); }};
  return kFamily;
}

BusConfig ListenerBus() {
  BusConfig bus = PolledBus(2);
  bus.name = "can-0";
  bus.family = &ListenerFamily();
  bus.link.port = "can0";
  bus.link.bitrate = 250'000;
  return bus;
}

class CanHealthTest : public ::testing::Test {
 protected:
  CanHealthTest() { link_.SetController(controller_); }

  void RunFor(MonoNs time) {
    for (const MonoNs end = clock_.Now() + time; clock_.Now() < end;) driver_.RunOnce();
  }
  // Sets the state of the controller.
  void Set(const CanController& controller) { link_.SetController(controller); }

  [[nodiscard]] std::vector<bus_health_t> Bus() const { return data_.All<bus_health_t>("BUS/can-0"); }
  [[nodiscard]] bool AlarmIsLive(const std::string& device, const std::string& name) const {
    const alarm_t last = data_.All<alarm_t>("ALARM/" + device).back();
    for (const alarm_entry_t& entry : last.entries) {
      if (entry.name == name && entry.state == alarm_entry_t::STATE_LIVE) return true;
    }
    return false;
  }

  FakeClock clock_{kStart};
  ScriptedFrameLink link_{clock_};
  FixedSecrets secrets_;
  MemorySink data_;
  MemorySink commands_;
  std::vector<std::string> log_;
  CanController controller_{.state = State::kActive, .tec = 1, .rec = 2, .bitrate = 250'000, .restart_ms = 0};
  BusConfig bus_ = ListenerBus();
  Driver driver_{bus_,
                 {},
                 Origin{.boot_id = 42},
                 DriverPorts{.frames = &link_,
                             .secrets = &secrets_,
                             .clock = &clock_,
                             .data = &data_,
                             .commands = &commands_,
                             .log = [this](LogLevel, std::string_view text) { log_.emplace_back(text); },
                             .link_warnings = {}}};
};

TEST_F(CanHealthTest, TheErrorCountersAreTold) {
  RunFor(1'500 * kMillisecond);
  EXPECT_EQ(Bus().back().state, bus_health_t::STATE_UP);
  EXPECT_EQ(Bus().back().can_tec, 1);
  EXPECT_EQ(Bus().back().can_rec, 2);
  EXPECT_THAT(Bus().back().last_error, IsEmpty());
}

TEST_F(CanHealthTest, BusOffIsToldWithin200MillisecondsOnEveryChannelAndOnBus) {
  RunFor(3'310 * kMillisecond);
  const std::size_t before = Bus().size();
  controller_.state = State::kBusOff;
  controller_.tec = 256;
  Set(controller_);
  const MonoNs at = clock_.Now();
  RunFor(200 * kMillisecond);
  ASSERT_GT(Bus().size(), before);
  const bus_health_t told = Bus()[before];
  EXPECT_LE(told.mono_ns, at + 200 * kMillisecond);
  EXPECT_EQ(told.state, bus_health_t::STATE_DEGRADED);
  EXPECT_EQ(told.can_tec, 256);
  EXPECT_THAT(told.last_error,
              AllOf(HasSubstr("can0: bus-off"), HasSubstr("ip link set can0 down; ip link set can0 up")));
  EXPECT_TRUE(AlarmIsLive("axis1", "can_bus_off"));
  EXPECT_TRUE(AlarmIsLive("axis2", "can_bus_off"));
  EXPECT_THAT(log_, Contains(HasSubstr("bus-off")));
}

TEST_F(CanHealthTest, WhenItIsOverTheAlarmGoesAndTheLastErrorStays) {
  RunFor(kSecond);
  controller_.state = State::kBusOff;
  Set(controller_);
  RunFor(kSecond);
  controller_.state = State::kActive;
  controller_.bus_offs = 1;
  Set(controller_);
  RunFor(4 * kSecond);
  EXPECT_TRUE(AlarmIsLive("axis1", "can_bus_off"));
  RunFor(3 * kSecond);
  EXPECT_FALSE(AlarmIsLive("axis1", "can_bus_off"));
  EXPECT_FALSE(AlarmIsLive("axis2", "can_bus_off"));
  EXPECT_EQ(Bus().back().state, bus_health_t::STATE_UP);
  EXPECT_THAT(Bus().back().last_error, HasSubstr("bus-off"));
  EXPECT_LT(Bus().back().last_error_utime, Bus().back().utime - 1'000'000);
  EXPECT_THAT(log_, Contains(HasSubstr("no alarm any more")));
}

TEST_F(CanHealthTest, AControllerThatWaversDoesNotFillTheLog) {
  RunFor(kSecond);
  for (int i = 0; i < 100; ++i) {
    controller_.state = i % 2 == 0 ? State::kPassive : State::kWarning;
    Set(controller_);
    RunFor(100 * kMillisecond);
  }
  EXPECT_LE(log_.size(), 4U);  // the line is open; passive, or first the warning
}

TEST_F(CanHealthTest, AHealthyBusIsToldOnceASecond) {
  RunFor(10 * kSecond);
  EXPECT_LE(Bus().size(), 12U);  // and when the controller's state became known
}

TEST_F(CanHealthTest, WhatTheSocketLostIsCounted) {
  RunFor(kSecond);
  link_.SetErrors({.framing = 3, .dropped = 7});
  controller_.dropped = 7;
  Set(controller_);
  RunFor(2 * kSecond);
  EXPECT_EQ(Bus().back().rx_dropped, 7);
  EXPECT_TRUE(AlarmIsLive("axis1", "can_frames_lost"));
}

TEST_F(CanHealthTest, ALostInterfaceIsDownWithItsReason) {
  RunFor(kSecond);
  link_.RefuseOpens(1'000, "can0 is down; as root: ip link set can0 up type can bitrate 250000 restart-ms 100");
  link_.LoseAt(clock_.Now() + 50 * kMillisecond);
  Set({.state = State::kStopped});
  RunFor(2 * kSecond);
  EXPECT_EQ(Bus().back().state, bus_health_t::STATE_DOWN);
  EXPECT_THAT(Bus().back().last_error, HasSubstr("ip link set can0 up"));
  EXPECT_TRUE(AlarmIsLive("axis1", "link_down"));
}

}  // namespace
}  // namespace axlecast
