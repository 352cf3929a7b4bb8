#include "bridge/dispatch/command_port.h"

#include <gtest/gtest.h>
#include <axlecast/command_body_t.hpp>
#include <axlecast/device_info_t.hpp>
#include <cstring>
#include <string>

#include "core/messages/message.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

TEST(DriverLinkTest, WhoJustBeganToListenCannotTellThatADriverIsAbsent) {
  DriverLink link;
  link.ListenFrom(100 * kSecond);
  EXPECT_FALSE(link.IsPresent(100 * kSecond));
  EXPECT_FALSE(link.IsAbsent(100 * kSecond + DriverLink::kAbsentAfter));
  EXPECT_TRUE(link.IsAbsent(100 * kSecond + DriverLink::kAbsentAfter + 1));
}

TEST(DriverLinkTest, AGoodbyeIsAbsenceAtOnce) {
  DriverLink link;
  link.ListenFrom(0);
  driver_status_t hello{};
  hello.boot_id = 7;
  hello.kind = driver_status_t::KIND_HELLO;
  ASSERT_TRUE(link.On(hello, kSecond));
  EXPECT_TRUE(link.IsPresent(2 * kSecond));
  EXPECT_FALSE(link.IsAbsent(2 * kSecond));
  hello.kind = driver_status_t::KIND_GOODBYE;
  ASSERT_TRUE(link.On(hello, 2 * kSecond));
  EXPECT_TRUE(link.IsAbsent(2 * kSecond));
}

// Anybody may send DRIVER_STATUS where commands may be unsigned; each name in it cost memory for ever.
TEST(DriverLinkTest, KnowsOnlyTheDevicesOfItsBusHoweverManyNamesCome) {
  DriverLink link;
  DeviceConfig axis;
  axis.name = "axis1";
  link.Expect({axis});
  link.ListenFrom(0);
  driver_status_t hello{};
  hello.boot_id = 7;
  hello.kind = driver_status_t::KIND_HELLO;
  for (int i = 0; i < 10'000; ++i) {
    driver_device_t device{};
    device.device = i == 5'000 ? "axis1" : "x" + std::to_string(i);
    device.state = device_info_t::STATE_ONLINE;
    hello.devices = {device};
    ASSERT_TRUE(link.On(hello, kSecond));
  }
  EXPECT_EQ(link.devices(), 1U);
  EXPECT_TRUE(link.IsAnswering("axis1"));
  EXPECT_FALSE(link.IsAnswering("x9999"));
}

// Anybody may invent boots, too. The newest replaced ones are remembered: a late message of theirs brings none back.
TEST(DriverLinkTest, RemembersTheLastReplacedBootsAlone) {
  DriverLink link;
  link.ListenFrom(0);
  driver_status_t hello{};
  hello.kind = driver_status_t::KIND_HELLO;
  for (hello.boot_id = 1; hello.boot_id <= 1'000; ++hello.boot_id) ASSERT_TRUE(link.On(hello, kSecond));
  int remembered = 0;
  for (hello.boot_id = 999; hello.boot_id > 0 && !link.On(hello, kSecond); --hello.boot_id) ++remembered;
  EXPECT_EQ(remembered, 64);
}

driver_status_t StatusOfBoot(std::int64_t boot_id, std::int8_t kind) {
  driver_status_t status{};
  status.boot_id = boot_id;
  status.kind = kind;
  return status;
}

driver_status_t HelloOf(std::int64_t boot_id, std::int8_t state_of_axis1) {
  driver_status_t hello = StatusOfBoot(boot_id, driver_status_t::KIND_HELLO);
  driver_device_t device{};
  device.device = "axis1";
  device.state = state_of_axis1;
  hello.devices = {device};
  return hello;
}

class DriverLinkOfOneAxisTest : public testing::Test {
 protected:
  DriverLinkOfOneAxisTest() {
    DeviceConfig axis;
    axis.name = "axis1";
    link_.Expect({axis});
    link_.ListenFrom(0);
  }
  bool On(const driver_status_t& status, MonoNs now = kSecond) { return link_.On(status, now); }

  DriverLink link_;
};

TEST_F(DriverLinkOfOneAxisTest, ABootIsKnownByItsHelloOnly) {
  EXPECT_FALSE(On(StatusOfBoot(7, driver_status_t::KIND_STATUS)));
  EXPECT_FALSE(On(StatusOfBoot(0, driver_status_t::KIND_HELLO)));
  EXPECT_FALSE(link_.IsRunning());
  EXPECT_TRUE(On(StatusOfBoot(7, driver_status_t::KIND_HELLO)));
  EXPECT_TRUE(On(StatusOfBoot(7, driver_status_t::KIND_STATUS)));
  EXPECT_FALSE(On(StatusOfBoot(8, driver_status_t::KIND_STATUS)));
  EXPECT_EQ(link_.boot_id(), 7);
}

TEST_F(DriverLinkOfOneAxisTest, AfterItsGoodbyeOnlyTheStatusOfACommandCounts) {
  ASSERT_TRUE(On(HelloOf(7, device_info_t::STATE_ONLINE)));
  ASSERT_TRUE(On(StatusOfBoot(7, driver_status_t::KIND_GOODBYE)));
  EXPECT_TRUE(On(StatusOfBoot(7, driver_status_t::KIND_STATUS)));
  EXPECT_FALSE(On(StatusOfBoot(7, driver_status_t::KIND_HELLO)));
  EXPECT_FALSE(link_.IsRunning());
}

TEST_F(DriverLinkOfOneAxisTest, ADeviceAnswersIfItIsOnlineOrDegraded) {
  EXPECT_FALSE(link_.IsAnswering("axis1"));
  EXPECT_FALSE(link_.IsAnswering("axis2"));
  ASSERT_TRUE(On(HelloOf(7, device_info_t::STATE_DEGRADED)));
  EXPECT_TRUE(link_.IsAnswering("axis1"));
  ASSERT_TRUE(On(HelloOf(7, device_info_t::STATE_OFFLINE)));
  EXPECT_FALSE(link_.IsAnswering("axis1"));
  ASSERT_TRUE(On(HelloOf(7, device_info_t::STATE_ONLINE)));
  EXPECT_TRUE(link_.IsAnswering("axis1"));
}

TEST_F(DriverLinkOfOneAxisTest, ANewBootBeginsWithoutTheStateOfTheOneBefore) {
  ASSERT_TRUE(On(HelloOf(1, device_info_t::STATE_ONLINE)));
  ASSERT_TRUE(On(StatusOfBoot(1, driver_status_t::KIND_GOODBYE)));
  ASSERT_TRUE(On(StatusOfBoot(2, driver_status_t::KIND_HELLO)));
  EXPECT_TRUE(link_.IsRunning());
  EXPECT_FALSE(link_.IsAnswering("axis1"));
  EXPECT_FALSE(On(StatusOfBoot(1, driver_status_t::KIND_HELLO))) << "it was replaced";
  const MonoNs silent = kSecond + DriverLink::kAbsentAfter + 1;
  EXPECT_TRUE(On(StatusOfBoot(1, driver_status_t::KIND_HELLO), silent)) << "its successor failed";
  EXPECT_FALSE(On(StatusOfBoot(2, driver_status_t::KIND_HELLO), silent));
}

TEST(CommandPortTest, AnEpochThatNoBridgeCanHaveReachedIsIgnored) {
  MemorySink sink;
  CommandPort port(sink, Origin{}, nullptr, 10);
  port.RaiseEpoch(9);
  EXPECT_EQ(port.epoch(), 10);
  port.RaiseEpoch((std::int64_t{1} << 62) - 1);
  EXPECT_EQ(port.epoch(), (std::int64_t{1} << 62) - 1);
  port.RaiseEpoch(std::int64_t{1} << 62);
  EXPECT_EQ(port.epoch(), (std::int64_t{1} << 62) - 1);
}

// ---- a second bridge ----

TEST(DuplicateBridgeDetectorTest, AsksEvery100MsWhileItListens) {
  DuplicateBridgeDetector watch(7, kSecond);
  constexpr MonoNs kMs = kMillisecond;
  EXPECT_TRUE(watch.Probe(kSecond));
  EXPECT_FALSE(watch.Probe(kSecond + 99 * kMs));
  EXPECT_TRUE(watch.Probe(kSecond + 100 * kMs));
  EXPECT_FALSE(watch.Probe(kSecond + 101 * kMs));
  EXPECT_TRUE(watch.Probe(kSecond + 299 * kMs));
  EXPECT_FALSE(watch.Probe(kSecond + DuplicateBridgeDetector::kListen));
  EXPECT_FALSE(watch.Probe(5 * kSecond));
}

TEST(DuplicateBridgeDetectorTest, AsksForACommandThatNobodyGave) {
  constexpr std::int64_t kOwnBoot = 0x0102'0304'0506'0708;
  DuplicateBridgeDetector watch(kOwnBoot, 0);
  const std::optional<command_t> question = watch.Probe(0);
  ASSERT_TRUE(question);
  EXPECT_EQ(question->body_size, static_cast<std::int16_t>(question->body.size()));
  const auto body = DecodeMessage<command_body_t>(question->body);
  ASSERT_TRUE(body);
  EXPECT_EQ(body->mode, command_body_t::MODE_QUERY);
  EXPECT_EQ(body->valid_ms, 1);
  EXPECT_EQ(body->expect_epoch, -1);
  std::int64_t id = 0;
  std::memcpy(&id, body->id, sizeof id);
  EXPECT_EQ(id, kOwnBoot) << "two bridges ask for two commands";
}

TEST(DuplicateBridgeDetectorTest, ForgetsAnotherBridgeTenSecondsAfterItsLastMessage) {
  DuplicateBridgeDetector watch(7, 0);
  EXPECT_EQ(watch.Other(0), std::nullopt);
  watch.OnOther(1, kSecond);
  EXPECT_EQ(watch.Other(kSecond + DuplicateBridgeDetector::kForget), 1);
  EXPECT_EQ(watch.Other(kSecond + DuplicateBridgeDetector::kForget + 1), std::nullopt);
}

}  // namespace

}  // namespace axlecast
