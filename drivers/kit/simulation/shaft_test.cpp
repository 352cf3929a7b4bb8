#include "drivers/kit/simulation/shaft.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace axlecast {
namespace {

constexpr MonoNs kHour = 3'600 * kSecond;
constexpr MonoNs kStart = 12'345 * kSecond;

double Turns(const Shaft& shaft, MonoNs at) {
  return static_cast<double>(shaft.At(at).angle) / static_cast<double>(kShaftTurn);
}
double Degrees(const Shaft& shaft, MonoNs at) { return DegreesFromAngle(shaft.At(at).angle); }

TEST(ShaftTest, StandsUntilOrdered) {
  const Shaft shaft(AngleFromDegrees(90));
  EXPECT_EQ(shaft.At(0).angle, kShaftTurn / 4);
  EXPECT_EQ(shaft.At(1'000 * kHour).angle, kShaftTurn / 4);
  EXPECT_EQ(shaft.Over(0, 1'000 * kHour).fastest_rpm, 0);
}

TEST(ShaftTest, SpeedsUpWithItsAccelerationAndThenKeepsItsSpeed) {
  Shaft shaft;
  shaft.SetAcceleration(2 * std::numbers::pi * 10);  // 10 turns/s^2
  shaft.Run(600, kStart);                            // 10 turns/s, reached after 1 s and 5 turns
  EXPECT_NEAR(shaft.At(kStart + kSecond / 2).speed_rpm, 300, 1e-6);
  EXPECT_NEAR(Turns(shaft, kStart + kSecond / 2), 1.25, 1e-8);
  EXPECT_NEAR(Turns(shaft, kStart + kSecond), 5, 1e-8);
  EXPECT_NEAR(Turns(shaft, kStart + 11 * kSecond), 105, 1e-8);
  EXPECT_NEAR(shaft.At(kStart + 11 * kSecond).speed_rpm, 600, 1e-6);
  EXPECT_EQ(shaft.At(kStart + 11 * kSecond).accel_rad_s2, 0);
}

TEST(ShaftTest, ClockwiseIsNegative) {
  Shaft shaft;
  shaft.Run(-60, kStart);
  EXPECT_LT(Turns(shaft, kStart + 10 * kSecond), -9.9);
}

// 60 rpm is one turn a second: after 200 days exactly so many turns more than after 10 s, to 2^-30 of a turn.
TEST(ShaftTest, DoesNotDrift) {
  Shaft shaft;
  shaft.Run(60, 0);
  const ShaftAngle early = shaft.At(10 * kSecond).angle;
  const std::int64_t seconds = 200 * 24 * 3'600;
  EXPECT_EQ(shaft.At((10 + seconds) * kSecond).angle - early, seconds * kShaftTurn);
}

TEST(ShaftTest, BrakesFromSpeedToStandstill) {
  Shaft shaft;
  shaft.SetAcceleration(2 * std::numbers::pi * 10);
  shaft.Run(600, 0);
  shaft.Run(0, 2 * kSecond);  // at 15 turns; 5 more to stop
  EXPECT_NEAR(Turns(shaft, 3 * kSecond), 20, 1e-8);
  EXPECT_EQ(shaft.At(3 * kSecond + 1).speed_rpm, 0);
  EXPECT_EQ(shaft.At(3 * kSecond + 1).angle, shaft.At(kHour).angle);
}

TEST(ShaftTest, MovesInATrapezoidAndStandsExactlyAtItsTarget) {
  Shaft shaft(AngleFromDegrees(10));
  shaft.SetAcceleration(100);
  shaft.MoveTo(AngleFromDegrees(720), 120, kStart);
  EXPECT_EQ(shaft.At(kStart + 10 * kSecond).angle, 2 * kShaftTurn);
  const Shaft::Extent extent = shaft.Over(kStart, kStart + 10 * kSecond);
  EXPECT_NEAR(extent.fastest_rpm, 120, 1e-6);
  EXPECT_NEAR(extent.hardest_rad_s2, 100, 1e-6);
  EXPECT_EQ(extent.lowest, AngleFromDegrees(10));
  EXPECT_EQ(extent.highest, 2 * kShaftTurn);
}

TEST(ShaftTest, AShortMoveNeverReachesItsSpeed) {
  Shaft shaft;
  shaft.SetAcceleration(10);
  shaft.MoveTo(AngleFromDegrees(-1), 6'000, kStart);
  EXPECT_EQ(shaft.At(kStart + kSecond).angle, AngleFromDegrees(-1));
  // v = sqrt(a d)
  const double rad_s = std::sqrt(10 * std::numbers::pi / 180);
  EXPECT_NEAR(shaft.Over(kStart, kStart + kSecond).fastest_rpm, rad_s * 60 / (2 * std::numbers::pi), 1e-5);
}

TEST(ShaftTest, ShuttlesForEver) {
  Shaft shaft;
  shaft.SetAcceleration(1'000);
  shaft.Shuttle(AngleFromDegrees(0), AngleFromDegrees(90), 60, 0);
  const Shaft::Extent extent = shaft.Over(0, 100 * kHour);
  EXPECT_EQ(extent.lowest, 0);
  EXPECT_EQ(extent.highest, kShaftTurn / 4);
  EXPECT_EQ(extent.slowest_rpm, 0);
  // One way: 0.25 turn at 1 turn/s, and one more v/a for speeding up and braking.
  const double one_way = 0.25 + 2 * std::numbers::pi / 1'000;
  EXPECT_NEAR(Degrees(shaft, static_cast<MonoNs>(one_way * 1e9)), 90, 1e-6);
  EXPECT_NEAR(Degrees(shaft, static_cast<MonoNs>(2'001 * one_way * 1e9)), 90, 1e-3);
  EXPECT_NEAR(Degrees(shaft, static_cast<MonoNs>(2'000 * one_way * 1e9)), 0, 1e-3);
}

// The rounding of each ramp once led some 2^-30 turn beyond the ends: a counter of turns overflowed, and no position ever
// showed it.
TEST(ShaftTest, AShuttleNeverLeavesItsEnds) {
  for (const double to_deg : {360.0, 720.0, 3'600.0, 123.4}) {
    for (const double rpm : {59.7, 300.0, 3'000.0}) {
      Shaft shaft;
      shaft.Shuttle(0, AngleFromDegrees(to_deg), rpm, 0);
      const Shaft::Extent extent = shaft.Over(0, kHour);
      EXPECT_EQ(extent.lowest, 0) << to_deg << " deg at " << rpm << " rpm";
      EXPECT_EQ(extent.highest, AngleFromDegrees(to_deg)) << to_deg << " deg at " << rpm << " rpm";
    }
  }
}

TEST(ShaftTest, SwingsAboutTheAngleWhereItStood) {
  Shaft shaft(AngleFromDegrees(100));
  const MonoNs period = 2 * kSecond;
  shaft.Swing(AngleFromDegrees(30), period, 0);
  const MonoNs later = 1'000 * period;
  const Shaft::Extent extent = shaft.Over(later, later + period);
  EXPECT_NEAR(DegreesFromAngle(extent.lowest), 70, 1e-6);
  EXPECT_NEAR(DegreesFromAngle(extent.highest), 130, 1e-6);
  // Peaks of A sin(wt): A w and A w^2.
  const double amplitude = std::numbers::pi / 6;
  EXPECT_NEAR(extent.fastest_rpm, amplitude * std::numbers::pi * 60 / (2 * std::numbers::pi), 1e-6);
  EXPECT_NEAR(extent.hardest_rad_s2, amplitude * std::numbers::pi * std::numbers::pi, 1e-6);
  EXPECT_NEAR(Shaft::SwingAcceleration(AngleFromDegrees(30), period), extent.hardest_rad_s2, 1e-6);
  EXPECT_EQ(shaft.At(later).angle, shaft.At(later + 1'000'000 * period).angle);
}

// Whatever is ordered when: between two looks the shaft never moves or changes speed more than physics allows.
TEST(ShaftTest, NeverJumps) {
  Shaft shaft;
  shaft.SetAcceleration(500);
  shaft.Run(1'000, kSecond);
  MonoNs now = 0;
  Shaft::State last = shaft.At(now);
  for (int step = 1; step < 100'000; ++step) {
    now += 100 * kMicrosecond;
    if (step == 20'000) shaft.Swing(AngleFromDegrees(45), kSecond, now);
    if (step == 40'000) shaft.Shuttle(0, 3 * kShaftTurn, 900, now);
    if (step == 60'000) shaft.Run(-777, now);
    if (step == 70'000) shaft.MoveTo(5 * kShaftTurn, 200, now);
    if (step == 80'000) shaft.Run(0, now);
    const Shaft::State state = shaft.At(now);
    const double moved_turns = static_cast<double>(state.angle - last.angle) / static_cast<double>(kShaftTurn);
    const double mean_rpm = (state.speed_rpm + last.speed_rpm) / 2;
    ASSERT_NEAR(moved_turns, mean_rpm / 60 * 1e-4, 2e-7) << step;
    const double accel = (state.speed_rpm - last.speed_rpm) / 60 * 2 * std::numbers::pi / 1e-4;
    ASSERT_LE(std::abs(accel), 500.1) << step;
    last = state;
  }
}

TEST(ShaftTest, ExtentHoldsWhatHappenedBetweenTwoLooks) {
  Shaft shaft;
  shaft.SetAcceleration(2 * std::numbers::pi);
  shaft.Run(60, 0);
  shaft.Run(-60, 10 * kSecond);  // turns half a turn further, stops for an instant, and returns
  const ShaftAngle turning_point = shaft.At(11 * kSecond).angle;
  const Shaft::Extent extent = shaft.Over(10 * kSecond, 12 * kSecond);
  EXPECT_EQ(extent.highest, turning_point);
  EXPECT_GT(turning_point, shaft.At(10 * kSecond).angle + kShaftTurn / 3);
  EXPECT_NEAR(extent.slowest_rpm, 0, 1e-6);
  EXPECT_NEAR(extent.fastest_rpm, 60, 1e-6);
}

}  // namespace
}  // namespace axlecast
