#include <gtest/gtest.h>

#include <array>
#include <axlecast/command_status_t.hpp>
#include <axlecast/driver_status_t.hpp>

#include "core/command/commands.h"
#include "drivers/runtime/command/command_server_fixture.h"
#include "drivers/runtime/command/driver_command_server.h"
#include "tests/support/counting_family.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr std::int64_t kBoot = 5;

// The content of a driver's statuses.
class DriverStatusTest : public CommandServerTest {
 protected:
  DriverStatusTest() : CommandServerTest(driver_order_t::KIND_EXECUTE) {}
};

TEST_F(DriverStatusTest, HasItsKindItsOriginAndItsTime) {
  const driver_status_t first = Send(1);
  EXPECT_EQ(first.kind, driver_status_t::KIND_STATUS);
  EXPECT_EQ(first.boot_id, kBoot);
  EXPECT_EQ(first.mono_ns, clock_.Now());
  EXPECT_EQ(first.utime, clock_.UtcMicroseconds());
  EXPECT_EQ(first.epoch_after, -1);
  EXPECT_EQ(first.started_utime, 0);
  clock_.Advance(kMillisecond);
  clock_.StepUtc(3'600'000'000);
  EXPECT_EQ(Send(1).utime, clock_.UtcMicroseconds()) << "UNIX time was stepped";
}

TEST_F(DriverStatusTest, HasTheTimesAtWhichTheCommandBeganAndEnded) {
  Send(1);
  clock_.Advance(100 * kMillisecond);
  ASSERT_TRUE(server_.Take());
  const std::int64_t started = clock_.UtcMicroseconds();
  EXPECT_EQ(Last().started_utime, started);
  EXPECT_EQ(Last().finished_utime, 0);
  clock_.Advance(100 * kMillisecond);
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded}, -1);
  EXPECT_EQ(Last().started_utime, started);
  EXPECT_EQ(Last().finished_utime, clock_.UtcMicroseconds());
}

TEST_F(DriverStatusTest, HasTheTimeOfItsEndAlsoIfItIsTheFirst) {
  EXPECT_EQ(Send(1, driver_order_t::KIND_EXECUTE, "explode").state, S::STATE_REJECTED);
  EXPECT_EQ(Last().finished_utime, clock_.UtcMicroseconds());
}

TEST_F(DriverStatusTest, OfAQueryStatesThatTheCommandNeverCame) {
  EXPECT_EQ(Send(1, driver_order_t::KIND_QUERY).state, S::STATE_UNKNOWN);
  EXPECT_EQ(Last().text, "this boot of the driver has not received it");
  EXPECT_EQ(IdOf(Last().id), NumberedId(1));
}

TEST_F(DriverStatusTest, OfProgressHasItsReasonAndItsOwnChanges) {
  Send(1);
  ASSERT_TRUE(server_.Take());
  clock_.Advance(50 * kMillisecond);
  const Outcome progress = {
      .reason = S::REASON_DEVICE_ALARM, .text = "waits", .changes = {{"counts", "1", "2"}, {"turns", "0", "1"}}};
  server_.Report("axis1", NumberedId(1), progress, -1);
  EXPECT_EQ(Last().reason_code, S::REASON_DEVICE_ALARM);
  EXPECT_EQ(Last().n_changes, 2);
  server_.Report("axis1", NumberedId(1), {.state = CommandState::kSucceeded, .changes = {{"counts", "1", "3"}}},
                 -1);
  ASSERT_EQ(Last().n_changes, 1);
  EXPECT_EQ(Last().changes[0].after, "3");
  EXPECT_EQ(Last().reason_code, S::REASON_NONE);
}

TEST_F(DriverStatusTest, OfADeviceNamesItsAcknowledgedAlarms) {
  const std::array<std::string, 2> alarms = {"battery_error", "over_heat"};
  server_.PublishAcknowledged("axis2", alarms);
  EXPECT_EQ(Last().kind, driver_status_t::KIND_ACKNOWLEDGED);
  EXPECT_EQ(Last().device, "axis2");
  EXPECT_EQ(Last().text, "battery_error over_heat");
  EXPECT_EQ(Last().epoch_after, -1);
  server_.PublishAcknowledged("axis2", std::vector<std::string>(20, "battery_error"));
  EXPECT_EQ(Last().text.back(), '*') << "not all fit";
}

class HelloTest : public testing::Test {
 protected:
  std::vector<driver_status_t> Hello(std::vector<driver_device_t> devices) {
    server_.Hello(devices);
    return sink_.All<driver_status_t>("DRIVER_STATUS/" + bus_.name);
  }

  FakeClock clock_;
  MemorySink sink_;
  SigningKey key_ = SigningKey::Generate();
  BusConfig bus_ = CountingBus(std::string(24, 'b'), {"axis1"});
  DriverCommandServer server_{bus_, {}, {{.boot_id = 5}, &clock_, &sink_, [] {}, &key_}};
};

TEST_F(HelloTest, TellsWhatTheBridgeKeeps) {
  driver_device_t summary{};
  summary.device = "axis1";
  summary.state = 2;
  summary.datum_epoch = 7;
  summary.reference_lost = summary.has_datum = summary.has_position = 1;
  summary.identity = "17 SN0042";
  summary.datum_counts = -5;
  summary.datum_utime = 6;
  summary.position = 1'000;
  summary.position_utime = 8;
  const auto hellos = Hello({summary});
  ASSERT_EQ(hellos.size(), 1u);
  const driver_device_t& device = hellos[0].devices.at(0);
  EXPECT_EQ(device.identity, "17 SN0042");
  EXPECT_EQ(device.has_datum, 1);
  EXPECT_EQ(device.datum_counts, -5);
  EXPECT_EQ(device.datum_utime, 6);
  EXPECT_EQ(device.has_position, 1);
  EXPECT_EQ(device.position, 1'000);
  EXPECT_EQ(device.position_utime, 8);
  EXPECT_EQ(device.reference_lost, 1);
}

// With every string longer than it may be, no device is left out and each message fits one frame.
TEST_F(HelloTest, TheLongestFits) {
  driver_device_t longest{};
  longest.device = std::string(900, 'd');
  longest.identity = std::string(900, 'i');
  longest.has_datum = longest.has_position = 1;
  longest.datum_counts = longest.position = INT64_MIN;
  longest.datum_utime = longest.position_utime = INT64_MAX;
  const auto hellos = Hello(std::vector<driver_device_t>(17, longest));
  ASSERT_EQ(hellos.size(), 3u);
  EXPECT_EQ(hellos[0].n_devices, 8);
  EXPECT_EQ(hellos[2].n_devices, 1);
  EXPECT_EQ(hellos[0].devices[7].identity.size(), 64u);
  EXPECT_LE(hellos[0].getEncodedSize(), kMaxMessage);
  EXPECT_TRUE(VerifyMessage(key_.public_key(), Domain::kDriver, hellos[0]));
}

}  // namespace
}  // namespace axlecast
