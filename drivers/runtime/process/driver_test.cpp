#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <axlecast/alarm_t.hpp>
#include <axlecast/command_status_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <axlecast/driver_status_t.hpp>
#include <axlecast/position_block_t.hpp>
#include <axlecast/position_t.hpp>
#include <axlecast/time_quality_t.hpp>
#include <axlecast/wire_t.hpp>
#include <memory>
#include <string>
#include <vector>

#include "core/device/link.h"
#include "drivers/runtime/process/driver.h"
#include "tests/support/counting_family.h"
#include "tests/support/fixed_secrets.h"
#include "tests/support/memory_sink.h"
#include "tests/support/polled_device.h"
#include "tests/support/polled_family.h"
#include "tests/support/scripted_link.h"

namespace axlecast {
namespace {

using ::testing::Contains;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::int64_t kBoot = 42;
constexpr std::int64_t kClock = 43;
constexpr MonoNs kStart = 1'000 * kSecond;
const std::string kStatusChannel = "DRIVER_STATUS/rs485-0";

class DriverTest : public ::testing::Test {
 protected:
  void Make() {
    driver_ = std::make_unique<Driver>(
        bus_, bridge_, Origin{.boot_id = kBoot, .clock_id = kClock},
        DriverPorts{.link = &link_,
                    .secrets = &secrets_,
                    .clock = &clock_,
                    .data = &data_,
                    .commands = &commands_,
                    .has_time_base = has_time_base_,
                    .log = [this](LogLevel, std::string_view text) { log_.emplace_back(text); },
                    .link_warnings = {}});
  }
  void RunUntil(MonoNs until) {
    while (clock_.Now() < kStart + until) driver_->RunOnce();
  }
  [[nodiscard]] std::vector<driver_status_t> Said(std::int8_t kind) const {
    std::vector<driver_status_t> found;
    for (const auto& status : commands_.All<driver_status_t>(kStatusChannel)) {
      if (status.kind == kind) found.push_back(status);
    }
    return found;
  }
  [[nodiscard]] device_info_t LastInfo() const { return data_.All<device_info_t>("DEVICE/axis1").back(); }
  [[nodiscard]] bool AlarmIsLive(const std::string& name) const {
    const alarm_t last = data_.All<alarm_t>("ALARM/axis1").back();
    for (const alarm_entry_t& entry : last.entries) {
      if (entry.name == name && entry.state == alarm_entry_t::STATE_LIVE) return true;
    }
    return false;
  }
  void HearDriver(std::int64_t boot_id, std::int8_t kind) {
    driver_status_t status{};
    status.boot_id = boot_id;
    status.kind = kind;
    driver_->duplicates().OnDriverStatus(Encoded(status));
  }
  // The order's last status.
  [[nodiscard]] driver_status_t DriverCommand(const driver_order_t& order) {
    driver_->command_server().OnDriverCommand(Enveloped(order));
    return Said(driver_status_t::KIND_STATUS).back();
  }

  FakeClock clock_{kStart};
  ScriptedLink link_{clock_, PolledDevices()};
  FixedSecrets secrets_;
  MemorySink data_;
  MemorySink commands_;
  std::vector<std::string> log_;
  BusConfig bus_ = PolledBus(1);
  BridgeConfig bridge_ = UnsignedBridge();
  bool has_time_base_ = false;
  std::unique_ptr<Driver> driver_;
};

TEST_F(DriverTest, PublishesWhatItShouldAsOftenAsItShould) {
  Make();
  RunUntil(5 * kSecond);
  EXPECT_EQ(link_.written().size(), 5'000U);  // poll_hz 1000
  EXPECT_NEAR(static_cast<double>(data_.All<position_t>("POSITION/axis1").size()), 5'000, 5);
  EXPECT_THAT(data_.All<bus_health_t>("BUS/rs485-0"), SizeIs(5));
  EXPECT_GE(data_.All<device_info_t>("DEVICE/axis1").size(), 5U);
  const auto hello = Said(driver_status_t::KIND_HELLO);
  EXPECT_GE(hello.size(), 5U);
  EXPECT_LE(hello.size(), 7U);  // and when the device came online
  EXPECT_EQ(hello.back().devices[0].state, device_info_t::STATE_ONLINE);
  EXPECT_EQ(LastInfo().state, device_info_t::STATE_ONLINE);
  EXPECT_THAT(data_.All<wire_t>("WIRE/rs485-0"), IsEmpty());
  const bus_health_t health = data_.All<bus_health_t>("BUS/rs485-0").back();
  EXPECT_EQ(health.state, bus_health_t::STATE_UP);
  EXPECT_NEAR(health.rate_hz, 1'000, 1);
  EXPECT_EQ(health.late, 0);
}

TEST_F(DriverTest, PublishesNothingOfABusWhoseLineAnotherProcessHasAndEnds) {
  const std::string held = "/dev/ttyUSB0: " + std::string(kLineHeld);
  link_.RefuseOpens(1'000, held);
  Make();
  RunUntil(kSecond);
  EXPECT_EQ(driver_->LineTaken(), "") << "the other one may be ending";
  RunUntil(Driver::kLineHeldFor + kSecond);
  EXPECT_EQ(driver_->LineTaken(), held);
  EXPECT_EQ(data_.size(), 0U);
  EXPECT_EQ(commands_.size(), 0U);
}

TEST_F(DriverTest, TakesALineThatItsPredecessorReleasesInTime) {
  link_.RefuseOpens(2, "/dev/ttyUSB0: " + std::string(kLineHeld));
  Make();
  RunUntil(4 * kSecond);
  EXPECT_EQ(driver_->LineTaken(), "");
  EXPECT_EQ(LastInfo().state, device_info_t::STATE_ONLINE);
}

TEST_F(DriverTest, PhaseAndPeriodOfTheSlotsAreConfigured) {
  bus_.poll_hz = 100;
  bus_.phase = 3 * kMillisecond;
  Make();
  RunUntil(kSecond);
  ASSERT_THAT(link_.write_times(), SizeIs(100));
  EXPECT_EQ(link_.write_times().front(), kStart + 3 * kMillisecond);
  EXPECT_EQ(link_.write_times().back(), kStart + 993 * kMillisecond);
}

TEST_F(DriverTest, EachPositionHasTheNumberOfItsTick) {
  bus_.poll_hz = 100;
  bus_.phase = 3 * kMillisecond;
  bus_.devices[0].publish_hz = 50;
  Make();
  RunUntil(kSecond);
  const auto positions = data_.All<position_t>("POSITION/axis1");
  ASSERT_THAT(positions, SizeIs(Ge(49U)));
  for (std::size_t i = 1; i < positions.size(); ++i) {
    EXPECT_EQ(positions[i].tick % 2, 0);
    EXPECT_EQ(positions[i].tick, (positions[i].mono_ns - bus_.phase) / (10 * kMillisecond));
  }
  const device_info_t info = LastInfo();
  EXPECT_EQ(info.tick_period_ns, 10 * kMillisecond);
  EXPECT_EQ(info.tick_phase_ns, 3 * kMillisecond);
  EXPECT_EQ(info.tick_base_id, 0);
}

TEST_F(DriverTest, TicksAreThoseOfTheTimeBaseWhileItIsKnown) {
  constexpr MonoNs kAhead = 7'000 * kSecond;
  has_time_base_ = true;
  bus_.poll_hz = 100;
  Make();
  RunUntil(kSecond);
  EXPECT_EQ(data_.All<position_t>("POSITION/axis1").back().tick, -1);
  time_quality_t quality{};
  quality.clock_id = kClock;
  quality.mono_ns = clock_.Now();
  quality.base_id = 5;
  quality.base_ns = clock_.Now() + kAhead;
  quality.half_width_ns = 100;
  quality.valid_ms = 1'000;
  quality.grade = time_quality_t::GRADE_PROVEN;
  driver_->base_clock().OnTime(Encoded(quality));
  RunUntil(1'900 * kMillisecond);
  const position_t last = data_.All<position_t>("POSITION/axis1").back();
  EXPECT_EQ(last.tick, (last.mono_ns + kAhead) / (10 * kMillisecond));
  EXPECT_EQ(LastInfo().tick_base_id, 5);
  RunUntil(3'500 * kMillisecond);
  EXPECT_EQ(data_.All<position_t>("POSITION/axis1").back().tick, -1) << "the claim is too old";
  EXPECT_EQ(LastInfo().tick_base_id, 0);
}

TEST_F(DriverTest, TheLineDoesNotWaitForTheNetworkWhereRequestsFollowEachOther) {
  bus_.poll_hz = 0;
  bus_.devices[0].publish_hz = 1e6;  // each reading
  Make();
  RunUntil(500 * kMillisecond);
  const auto positions = [this] { return data_.All<position_t>("POSITION/axis1").size(); };
  const std::size_t requests = link_.written().size();
  const std::size_t published = positions();
  RunUntil(510 * kMillisecond);
  ASSERT_GT(link_.written().size(), requests + 10);
  EXPECT_EQ(positions() - published, link_.written().size() - requests);
  const std::size_t before_stop = positions();
  driver_->Stop();
  EXPECT_EQ(positions(), before_stop + 1) << "the reading that waited for a request";
}

TEST_F(DriverTest, AnOrderIsAcknowledgedAtOnceAndCarriedOutAtTheBusesNextTurn) {
  bus_.poll_hz = 0;
  Make();
  RunUntil(500 * kMillisecond);
  const auto order = OrderMessage(kBoot, 1, NumberedId(1), "axis1", "touch");
  EXPECT_EQ(DriverCommand(order).state, command_status_t::STATE_ROUTED);
  const MonoNs sent = clock_.Now();
  driver_->RunOnce();
  const driver_status_t done = Said(driver_status_t::KIND_STATUS).back();
  EXPECT_EQ(done.state, command_status_t::STATE_SUCCEEDED);
  EXPECT_LE(clock_.Now() - sent, kMillisecond);
}

TEST_F(DriverTest, AnOrderWakesASleepingBus) {
  bus_.poll_hz = 1;
  Make();
  RunUntil(1'050 * kMillisecond);
  static_cast<void>(DriverCommand(OrderMessage(kBoot, 1, NumberedId(1), "axis1", "touch")));
  const MonoNs sent = clock_.Now();
  driver_->RunOnce();
  driver_->RunOnce();
  EXPECT_EQ(Said(driver_status_t::KIND_STATUS).back().state, command_status_t::STATE_SUCCEEDED);
  EXPECT_LE(clock_.Now() - sent, kMillisecond);
}

TEST_F(DriverTest, ASecondDriverOfTheBusIsAnAlarmForAsLongAsItIsHeard) {
  Make();
  RunUntil(kSecond);
  HearDriver(kBoot, driver_status_t::KIND_HELLO);  // our own
  RunUntil(1'200 * kMillisecond);
  EXPECT_FALSE(AlarmIsLive("duplicate_driver"));
  HearDriver(4711, driver_status_t::KIND_HELLO);
  RunUntil(1'500 * kMillisecond);
  EXPECT_TRUE(AlarmIsLive("duplicate_driver"));
  EXPECT_THAT(log_, Contains(HasSubstr("another driver")));
  RunUntil(4'500 * kMillisecond);
  EXPECT_FALSE(AlarmIsLive("duplicate_driver"));
  HearDriver(4711, driver_status_t::KIND_HELLO);
  RunUntil(5 * kSecond);
  HearDriver(4711, driver_status_t::KIND_GOODBYE);
  RunUntil(5'300 * kMillisecond);
  EXPECT_FALSE(AlarmIsLive("duplicate_driver"));
}

TEST_F(DriverTest, OrdersOfStrangersAreAnAlarmAndALine) {
  const SigningKey bridge_key = SigningKey::Generate();
  bridge_.bridge.public_key = bridge_key.public_key();
  Make();
  RunUntil(kSecond);
  EXPECT_FALSE(AlarmIsLive("foreign_order"));
  const auto order = OrderMessage(kBoot, 1, NumberedId(1), "axis1", "touch");
  for (int i = 0; i < 100; ++i) driver_->command_server().OnDriverCommand(Enveloped(order));
  RunUntil(1'300 * kMillisecond);
  EXPECT_TRUE(AlarmIsLive("foreign_order"));
  EXPECT_THAT(Said(driver_status_t::KIND_STATUS), IsEmpty());
  EXPECT_THAT(log_,
              Contains(HasSubstr("100 commands were refused without an answer: only commands that are signed")));
  driver_->command_server().OnDriverCommand(Enveloped(order, &bridge_key));
  RunUntil(1'400 * kMillisecond);
  EXPECT_EQ(Said(driver_status_t::KIND_STATUS).back().state, command_status_t::STATE_SUCCEEDED);
  RunUntil(12 * kSecond);
  EXPECT_FALSE(AlarmIsLive("foreign_order"));
}

TEST_F(DriverTest, HelloCarriesThePositionAndIsNotSaidForIt) {
  Make();
  RunUntil(3 * kSecond);
  const auto hello = Said(driver_status_t::KIND_HELLO);
  EXPECT_LE(hello.size(), 5U);
  ASSERT_EQ(hello.back().n_devices, 1);
  const driver_device_t& device = hello.back().devices[0];
  EXPECT_EQ(device.identity, "");
  EXPECT_EQ(device.has_datum, 0);
  ASSERT_EQ(device.has_position, 1);
  bool read = false;  // at that instant
  for (const position_t& position : data_.All<position_t>("POSITION/axis1")) {
    read = read || (position.utime == device.position_utime && position.counts == device.position);
  }
  EXPECT_TRUE(read);
}

TEST_F(DriverTest, HelloComesAtOnceWithADatum) {
  Make();
  RunUntil(3'050 * kMillisecond);
  const std::size_t before = Said(driver_status_t::KIND_HELLO).size();
  auto order = OrderMessage(kBoot, 1, NumberedId(1), "axis1", "set_datum");
  order.arguments = {{"counts", "7"}};
  order.n_arguments = 1;
  static_cast<void>(DriverCommand(order));
  RunUntil(3'250 * kMillisecond);
  const auto hello = Said(driver_status_t::KIND_HELLO);
  ASSERT_EQ(hello.size(), before + 1);
  EXPECT_EQ(hello.back().devices[0].has_datum, 1);
  EXPECT_EQ(hello.back().devices[0].datum_counts, 7);
}

TEST_F(DriverTest, DamagedStatusMessagesAreNoDriver) {
  Make();
  const std::vector<std::uint8_t> garbage(100, 0xA5);
  driver_->duplicates().OnDriverStatus(garbage);
  driver_->duplicates().OnDriverStatus({});
  EXPECT_FALSE(driver_->duplicates().Present(clock_.Now()));
}

TEST_F(DriverTest, AMissingPortIsAStateWithItsReason) {
  link_.RefuseOpens(3, "/dev/ttyTEST does not exist: plug the adapter in");
  Make();
  RunUntil(200 * kMillisecond);
  EXPECT_EQ(LastInfo().state, device_info_t::STATE_OFFLINE);
  EXPECT_THAT(LastInfo().reason, HasSubstr("plug the adapter in"));
  EXPECT_THAT(log_, SizeIs(1));
  RunUntil(2 * kSecond);
  EXPECT_EQ(LastInfo().state, device_info_t::STATE_ONLINE);
}

TEST_F(DriverTest, AStepOfUnixTimeIsFollowedAndFlagged) {
  Make();
  RunUntil(kSecond);
  clock_.StepUtc(5'000'000);
  RunUntil(1'300 * kMillisecond);
  int flagged = 0;
  for (const position_t& position : data_.All<position_t>("POSITION/axis1")) {
    flagged += (position.flags & position_t::FLAG_CLOCK_STEPPED) != 0 ? 1 : 0;
  }
  EXPECT_EQ(flagged, 1);
  EXPECT_NEAR(static_cast<double>(data_.All<position_t>("POSITION/axis1").back().utime),
              static_cast<double>(clock_.UtcMicroseconds()), 2'000);
  EXPECT_THAT(log_, Contains(HasSubstr("stepped")));
}

TEST_F(DriverTest, StopPublishesWhatWaitsAndSaysGoodbye) {
  bus_.devices[0].block = true;
  bus_.capture = true;
  Make();
  RunUntil(1'017 * kMillisecond);
  const MonoNs asked = clock_.Now();
  driver_->Stop();
  EXPECT_LE(clock_.Now() - asked, kSecond);
  std::size_t in_blocks = 0;
  for (const auto& block : data_.All<position_block_t>("POSITION_BLOCK/axis1")) in_blocks += block.counts.size();
  std::size_t on_wire = 0;
  for (const auto& message : data_.All<wire_t>("WIRE/rs485-0")) {
    for (const auto& record : message.records) {
      on_wire += record.direction == wire_record_t::DIRECTION_TRANSMIT ? 1 : 0;
    }
  }
  EXPECT_EQ(in_blocks, link_.written().size() - 1);  // the first reading waits for a second that agrees
  EXPECT_EQ(on_wire, link_.written().size());
  EXPECT_THAT(Said(driver_status_t::KIND_GOODBYE), SizeIs(1));
  EXPECT_FALSE(link_.IsOpen());
}

TEST_F(DriverTest, StopLetsAnOrderEndThatHasTouchedItsDevice) {
  Make();
  RunUntil(500 * kMillisecond);
  // The device answers the order's first two requests not at all.
  int unanswered = 2;
  link_.SetPeer([&, answer = PolledDevices()](Bytes request) {
    if (request[1] == PolledDevice::kTouch && unanswered-- > 0) return std::vector<ScriptedLink::Burst>{};
    return answer(request);
  });
  static_cast<void>(DriverCommand(OrderMessage(kBoot, 1, NumberedId(1), "axis1", "touch")));
  driver_->RunOnce();
  driver_->RunOnce();
  driver_->Stop();
  EXPECT_EQ(Said(driver_status_t::KIND_STATUS).back().state, command_status_t::STATE_SUCCEEDED);
}

TEST_F(DriverTest, AnOrderThatDoesNotEndInTimeIsIndeterminate) {
  Make();
  RunUntil(500 * kMillisecond);
  link_.SetPeer({});
  static_cast<void>(DriverCommand(OrderMessage(kBoot, 1, NumberedId(1), "axis1", "touch")));
  driver_->RunOnce();
  driver_->RunOnce();
  const MonoNs asked = clock_.Now();
  driver_->Stop();
  EXPECT_LE(clock_.Now() - asked, kSecond);
  EXPECT_EQ(Said(driver_status_t::KIND_STATUS).back().state, command_status_t::STATE_INDETERMINATE);
  EXPECT_EQ(Said(driver_status_t::KIND_STATUS).back().reason_code, command_status_t::REASON_STOPPING);
}

TEST_F(DriverTest, LinkWarningsAreLogged) {
  driver_ = std::make_unique<Driver>(
      bus_, bridge_, Origin{.boot_id = kBoot},
      DriverPorts{.link = &link_,
                  .secrets = &secrets_,
                  .clock = &clock_,
                  .data = &data_,
                  .commands = &commands_,
                  .log = [this](LogLevel, std::string_view text) { log_.emplace_back(text); },
                  .link_warnings = [] { return std::vector<std::string>{"latency timer is 16 ms"}; }});
  RunUntil(kMillisecond);
  EXPECT_THAT(log_, Contains("latency timer is 16 ms"));
}

TEST(UnauthorizedCommandCounter, IsThereAtOnceAndChangesAtMostEvery10Seconds) {
  UnauthorizedCommandCounter watch;
  MonoNs now = 1'000 * kSecond;
  EXPECT_FALSE(watch.Update(0, now));
  EXPECT_TRUE(watch.Update(1, now));
  EXPECT_TRUE(watch.present());
  EXPECT_FALSE(watch.Update(2, now + 9 * kSecond));
  EXPECT_FALSE(watch.Update(2, now + 10 * kSecond));  // one more had come
  EXPECT_TRUE(watch.present());
  EXPECT_TRUE(watch.Update(2, now + 20 * kSecond));
  EXPECT_FALSE(watch.present());
  EXPECT_FALSE(watch.Update(3, now + 29 * kSecond));
  EXPECT_TRUE(watch.Update(3, now + 30 * kSecond));
  int changes = 0;
  for (int second = 31; second < 131; ++second) {
    changes += watch.Update(second % 12 == 0 ? second : 3, now + second * kSecond) ? 1 : 0;
  }
  EXPECT_LE(changes, 10);
}

}  // namespace
}  // namespace axlecast
