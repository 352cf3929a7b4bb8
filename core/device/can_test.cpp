#include "core/device/can.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

// The same lines are typed on a real kernel in tests/vm/can_socket_test.cpp.
TEST(CanRemedyTest, TheLinesAsAnOperatorTypesThem) {
  EXPECT_EQ(CanUpLine("can0", 250'000, true), "ip link set can0 up type can bitrate 250000 restart-ms 100");
  EXPECT_EQ(CanAgainLine("can0", 250'000, true),
            "ip link set can0 down; ip link set can0 up type can bitrate 250000 restart-ms 100");
  EXPECT_EQ(CanRestartLine("can0"), "ip link set can0 down; ip link set can0 up");
}

TEST(CanRemedyTest, WhereTheRateOrTheRestartIsNotToBeHad) {
  EXPECT_EQ(CanUpLine("slcan0", 0, false), "ip link set slcan0 up type can bitrate BITRATE");
}

}  // namespace

}  // namespace axlecast
