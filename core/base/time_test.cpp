#include "core/base/time.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(TimebaseTest, FollowsTheFirstReadingAtOnce) {
  Timebase time;
  EXPECT_FALSE(time.Update(5 * kSecond, 1'000'000'000));
  EXPECT_EQ(time.Utime(5 * kSecond), 1'000'000'000);
  EXPECT_EQ(time.Utime(6 * kSecond), 1'001'000'000);
}

TEST(TimebaseTest, SlewsASmallDifference) {
  Timebase time;
  time.Update(0, 1'000'000);
  EXPECT_FALSE(time.Update(kSecond, 2'000'900));
  EXPECT_EQ(time.Utime(kSecond), 2'000'500);
  EXPECT_FALSE(time.Update(2 * kSecond, 3'000'900));
  EXPECT_EQ(time.Utime(2 * kSecond), 3'000'900);
  EXPECT_EQ(time.steps(), 0);
}

TEST(TimebaseTest, ReportsAStepAndFollowsIt) {
  Timebase time;
  time.Update(0, 1'000'000);
  EXPECT_TRUE(time.Update(kSecond, 2'001'001));
  EXPECT_EQ(time.Utime(kSecond), 2'001'001);
  EXPECT_TRUE(time.Update(2 * kSecond, 1'000'000));
  EXPECT_EQ(time.steps(), 2);
}

}  // namespace

}  // namespace axlecast
