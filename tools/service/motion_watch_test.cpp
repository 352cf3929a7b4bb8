#include "tools/service/motion_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

namespace axlecast {
namespace {

using ::testing::HasSubstr;

constexpr double kTurn = 131'072;

struct Settings final : DeviceSettings {};

class MotionWatchTest : public ::testing::Test {
 protected:
  MotionWatchTest() {
    auto settings = std::make_shared<Settings>();
    settings->max_speed_rpm = 6'000;
    settings->max_accel_rad_s2 = 80'000;
    device_.settings = settings;
  }

  // A second of positions, 1,000 of them; `angle` in rad at a time in s, read with 4 counts of noise.
  template <typename Angle>
  void Watch(Angle angle) {
    for (int i = 0; i < 1'000; ++i) {
      position_t position{};
      position.boot_id = 1;
      position.counts_per_turn = static_cast<std::int32_t>(kTurn);
      position.mono_ns = begin_ + i * 1'000'000LL;
      position.counts = static_cast<std::int64_t>(std::llround(angle(i * 1e-3) / (2 * std::numbers::pi) * kTurn)) +
                        (i * 7 % 9) - 4;
      watch_.On(position);
    }
    begin_ += 1'000'000'000LL;
  }
  AcceptanceResult Limits() const { return watch_.Judge(device_).findings.at(1); }

  DeviceConfig device_;
  MotionWatch watch_;
  std::int64_t begin_ = 5'000'000'000LL;
};

// 100 rad/s peak at 1 Hz: 955 rpm, 628 rad/s2. The noise of 8 counts within 20 ms is 2 rad/s2.
TEST_F(MotionWatchTest, ProposesLimitsWithAMargin) {
  Watch([](double t) { return 100 / (2 * std::numbers::pi) * std::sin(2 * std::numbers::pi * t); });
  EXPECT_NEAR(watch_.speed_rpm(), 955, 10);
  EXPECT_NEAR(watch_.accel_rad_s2(), 628, 10);
  EXPECT_EQ(Limits().what, "limits of the model only");
  EXPECT_EQ(Limits().value, "6000 rpm, 80000 rad/s2");
  EXPECT_EQ(Limits().verdict, Verdict::kUnjudged);
  EXPECT_THAT(Limits().advice, HasSubstr("limits: {speed_rpm: 1500, accel_rad_s2: 1300} in the machine's file"));
}

TEST_F(MotionWatchTest, AShaftThatStandsProposesNothing) {
  Watch([](double) { return 1.0; });
  EXPECT_LT(watch_.speed_rpm(), 1);
  EXPECT_THAT(Limits().advice, HasSubstr("run it again while the axis makes its fastest motions"));
}

TEST_F(MotionWatchTest, OwnLimitsThatAreNearlyReachedArePointedOut) {
  device_.speed_rpm = 3'000;
  device_.accel_rad_s2 = 5'000;
  const auto at = [](double rad_s) { return [rad_s](double t) { return rad_s * t; }; };
  Watch(at(100));
  EXPECT_EQ(Limits().what, "limits of the axis");
  EXPECT_EQ(Limits().verdict, Verdict::kGood);
  begin_ += 2'000'000'000LL;  // nobody saw how it became faster
  Watch(at(260));
  EXPECT_NEAR(watch_.speed_rpm(), 2'483, 5);
  EXPECT_EQ(Limits().verdict, Verdict::kAttention);
  EXPECT_THAT(Limits().advice, HasSubstr("limits: {speed_rpm: 3800"));
}

TEST_F(MotionWatchTest, AJumpWithoutMotionIsNoMotion) {
  Watch([](double) { return 1.0; });
  position_t zeroed{};
  zeroed.boot_id = 1;
  zeroed.datum_epoch = 1;
  zeroed.counts_per_turn = static_cast<std::int32_t>(kTurn);
  zeroed.mono_ns = begin_ + 30'000'000;
  watch_.On(zeroed);
  EXPECT_LT(watch_.speed_rpm(), 1);
}

TEST(ProposedLimit, IsRoundedUpAndAtMostTheModels) {
  EXPECT_DOUBLE_EQ(ProposedLimit(955, 1.5, 6'000), 1'500);
  EXPECT_DOUBLE_EQ(ProposedLimit(1'000, 1.5, 6'000), 1'500);
  EXPECT_DOUBLE_EQ(ProposedLimit(5'000, 1.5, 6'000), 6'000);
  EXPECT_DOUBLE_EQ(ProposedLimit(5'000, 2, 0), 10'000);
  EXPECT_DOUBLE_EQ(ProposedLimit(0, 2, 0), 1);
}

}  // namespace
}  // namespace axlecast
