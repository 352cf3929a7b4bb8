#include "drivers/kit/read_back.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

// 40" either way are 80" between two readings: 4.05 counts of 19.8" at 16 bits.
TEST(Accuracy, IsTwiceAsMuchBetweenTwoReadings) {
  EXPECT_EQ(NoiseOfAccuracy(40, 16), 5);
  EXPECT_EQ(NoiseOfAccuracy(20, 17), 5);
  EXPECT_EQ(NoiseOfAccuracy(15, 20), 25);
  EXPECT_EQ(NoiseOfAccuracy(5, 26), 518);
  EXPECT_EQ(NoiseOfAccuracy(5, 32), 33'141);
  EXPECT_EQ(NoiseOfAccuracy(40, 10), 1);
  EXPECT_EQ(NoiseOfAccuracy(0, 20), 1);
}

}  // namespace
}  // namespace axlecast
