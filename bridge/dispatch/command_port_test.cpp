#include "bridge/dispatch/command_port.h"

#include <gtest/gtest.h>
#include <axlecast/device_info_t.hpp>
#include <string>

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

}  // namespace

}  // namespace axlecast
