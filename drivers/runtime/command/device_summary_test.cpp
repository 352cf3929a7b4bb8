#include "core/command/device_summary.h"

#include <gtest/gtest.h>

#include <axlecast/driver_status_t.hpp>

#include "drivers/runtime/command/driver_command_server.h"
#include "tests/support/counting_family.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

class HelloTest : public testing::Test {
 protected:
  std::vector<driver_status_t> Hello(std::vector<DeviceSummary> devices) {
    desk_.Hello(devices);
    return sink_.All<driver_status_t>("DRIVER_STATUS/" + bus_.name);
  }

  FakeClock clock_;
  MemorySink sink_;
  SigningKey key_ = SigningKey::Generate();
  BusConfig bus_ = CountingBus(std::string(24, 'b'), {"axis1"});
  DriverCommandServer desk_{bus_, {}, {5, &clock_, &sink_, [] {}, &key_}};
};

TEST_F(HelloTest, TellsWhatTheBridgeKeeps) {
  const auto hellos = Hello({{.device = "axis1",
                              .state = 2,
                              .datum_epoch = 7,
                              .reference_lost = true,
                              .identity = "17 SN0042",
                              .datum = DeviceSummary::Datum{-5, 6},
                              .position = DeviceSummary::Position{1'000, 8}}});
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
  const DeviceSummary longest{.device = std::string(900, 'd'),
                              .identity = std::string(900, 'i'),
                              .datum = DeviceSummary::Datum{INT64_MIN, INT64_MAX},
                              .position = DeviceSummary::Position{INT64_MIN, INT64_MAX}};
  const auto hellos = Hello(std::vector<DeviceSummary>(17, longest));
  ASSERT_EQ(hellos.size(), 3u);
  EXPECT_EQ(hellos[0].n_devices, 8);
  EXPECT_EQ(hellos[2].n_devices, 1);
  EXPECT_EQ(hellos[0].devices[7].identity.size(), 64u);
  EXPECT_LE(hellos[0].getEncodedSize(), kMaxMessage);
  EXPECT_TRUE(VerifyMessage(key_.public_key(), Domain::kDriver, hellos[0]));
}

}  // namespace
}  // namespace axlecast
