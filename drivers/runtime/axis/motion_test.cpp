#include <gtest/gtest.h>
#include <cmath>
#include <numbers>
#include <random>

#include "drivers/runtime/axis/motion.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = 1 << 17;
constexpr double kMaxSpeed = 628.3185307;    // rad/s: 6,000 min-1, TS5669 spec 5.4
constexpr double kMaxAcceleration = 80'000;  // rad/s2
constexpr std::int64_t kNoise = 4;

MotionLimits Limits() { return {kTurn, 6'000, kMaxAcceleration, kNoise}; }

UnwrappedSample At(MonoNs at, std::int64_t counts, MonoNs half_width = 0) {
  return {counts, {at - half_width, at + half_width}};
}

// Seeds the judge with a first good reading.
void Start(Plausibility& judge, const UnwrappedSample& sample) {
  UnwrappedSample before = sample;
  before.at.first -= kMicrosecond;
  before.at.last -= kMicrosecond;
  ASSERT_EQ(judge.TakeDoubtful(before), Plausibility::Doubt::kFirst);
  ASSERT_EQ(judge.TakeDoubtful(sample), Plausibility::Doubt::kAcceptedAtStart);
}

// Largest distance by stepping through the motion in 1 us steps: no formula shared with the code.
double WalkAtFullSpeed(MonoNs duration) {
  double angle = 0;
  for (MonoNs t = 0; t < duration; t += kMicrosecond) {
    const auto step = static_cast<double>(std::min<MonoNs>(kMicrosecond, duration - t));
    angle += kMaxSpeed * step * 1e-9;
  }
  return angle / (2 * std::numbers::pi) * static_cast<double>(kTurn);
}

TEST(MotionLimits, SpeedBoundAgreesWithASteppedMotion) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 300; ++i) {
    const auto gap = static_cast<MonoNs>(random() % (5 * kMillisecond)) + 51 * kMicrosecond;
    const auto width = static_cast<MonoNs>(random() % 20'000);
    // The instants may be at the far ends of both intervals; noise and quantisation add.
    const double maximum = WalkAtFullSpeed(gap + 2 * width) + kNoise + 1;
    const UnwrappedSample from = At(kSecond, 1'000, width);
    const auto inside = static_cast<std::int64_t>(std::floor(maximum - 0.01));
    const auto outside = static_cast<std::int64_t>(std::ceil(maximum + 0.01));
    EXPECT_TRUE(Limits().SpeedAllows(from, At(kSecond + gap, 1'000 + inside, width)));
    EXPECT_TRUE(Limits().SpeedAllows(from, At(kSecond + gap, 1'000 - inside, width)));
    EXPECT_FALSE(Limits().SpeedAllows(from, At(kSecond + gap, 1'000 + outside, width)));
    EXPECT_FALSE(Limits().SpeedAllows(from, At(kSecond + gap, 1'000 - outside, width)));
  }
}

// Every constant acceleration and starting speed on a grid that passes exactly through a and b: where can c be?
struct Range {
  double minimum = 1e18;
  double maximum = -1e18;
};
Range BruteForceThird(double a_to_b, double first_s, double second_s) {
  const double scale = static_cast<double>(kTurn) / (2 * std::numbers::pi);
  const double limit = kMaxAcceleration * scale;
  Range range;
  // Piecewise constant accelerations: u on the first stretch, w on the second.
  for (int u = -50; u <= 50; ++u) {
    for (int w = -50; w <= 50; ++w) {
      const double au = limit * u / 50;
      const double aw = limit * w / 50;
      const double v0 = (a_to_b - au * first_s * first_s / 2) / first_s;
      const double v1 = v0 + au * first_s;
      const double c = v1 * second_s + aw * second_s * second_s / 2;
      range.minimum = std::min(range.minimum, c);
      range.maximum = std::max(range.maximum, c);
    }
  }
  return range;
}

TEST(MotionLimits, AccelerationBoundHoldsEveryMotionOfABruteForce) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 200; ++i) {
    const auto first = kMillisecond + static_cast<MonoNs>(random() % (3 * kMillisecond));
    const auto second = kMillisecond + static_cast<MonoNs>(random() % (3 * kMillisecond));
    const auto a_to_b = static_cast<std::int64_t>(random() % 10'000) - 5'000;
    const Range range = BruteForceThird(static_cast<double>(a_to_b), static_cast<double>(first) * 1e-9,
                                        static_cast<double>(second) * 1e-9);
    const UnwrappedSample a = At(kSecond, 0);
    const UnwrappedSample b = At(kSecond + first, a_to_b);
    const auto third = [&](double c) {
      return At(kSecond + first + second, a_to_b + static_cast<std::int64_t>(std::round(c)));
    };
    EXPECT_TRUE(Limits().AccelerationAllows(a, b, third(range.minimum)));
    EXPECT_TRUE(Limits().AccelerationAllows(a, b, third(range.maximum)));
    // Tight to what noise and quantisation of three readings leave open.
    const double ratio = static_cast<double>(second) / static_cast<double>(first);
    const double slack = (kNoise + 1) * (1 + ratio) + 3;
    EXPECT_FALSE(Limits().AccelerationAllows(a, b, third(range.minimum - slack)));
    EXPECT_FALSE(Limits().AccelerationAllows(a, b, third(range.maximum + slack)));
  }
}

TEST(MotionLimits, AccelerationIsJudgedBelowOneMillisecondToo) {
  const UnwrappedSample a = At(kSecond, 0);
  const UnwrappedSample b = At(kSecond + 2 * kMillisecond, 0);
  const MonoNs soon = kSecond + 2 * kMillisecond + 51 * kMicrosecond;
  // 80,000 rad/s2 for 2 ms, the noise, and 51 us: 5 + 0.13 + 87 counts.
  EXPECT_TRUE(Limits().AccelerationAllows(a, b, At(soon, 90)));
  EXPECT_FALSE(Limits().AccelerationAllows(a, b, At(soon, 95)));
  EXPECT_TRUE(Limits().AccelerationAllows(a, At(kSecond + 2 * kMillisecond, 0, kMillisecond), At(soon, 5'000)))
      << "their intervals overlap";
}

// 3,000 min-1, 1,000 rad/s2, a reading every 51 us: one that is off by more than the noise and the instants is doubted,
// and no good one.
TEST(Plausibility, OfASlowerAxisDoubtsWhatIsLittleOff) {
  constexpr std::int64_t kStep = 334;  // 3,000 min-1
  for (const std::int64_t per_reading : {std::int64_t{0}, std::int64_t{100}, kStep - 1}) {
    Plausibility judge(MotionLimits(kTurn, 3'000, 1'000, kNoise));
    MonoNs t = kSecond;
    std::int64_t counts = 0;
    Start(judge, At(t, 0, 100));
    for (int i = 0; i < 200; ++i) {
      t += 51 * kMicrosecond;
      counts += per_reading;
      const UnwrappedSample sample = At(t, counts, 100);
      ASSERT_TRUE(judge.Agrees(sample)) << per_reading << ' ' << i;
      if (i > 100) {
        EXPECT_FALSE(judge.Agrees(At(t, counts + 16, 100))) << per_reading << ' ' << i;
        EXPECT_FALSE(judge.Agrees(At(t, counts - 16, 100))) << per_reading << ' ' << i;
      }
      judge.Accept(sample, true);
    }
  }
}

// A shaft within its limits, read at any rate, with noise and instants anywhere in their intervals, is never
// doubted.
TEST(Plausibility, NeverDoubtsAPossibleMotion) {
  const double scale = static_cast<double>(kTurn) / (2 * std::numbers::pi);
  for (const MonoNs period : {51 * kMicrosecond, 250 * kMicrosecond, kMillisecond, 4 * kMillisecond}) {
    std::mt19937_64 random(static_cast<std::uint64_t>(period));
    std::uniform_real_distribution<double> any(-1, 1);
    Plausibility judge(Limits());
    double angle = 0;
    double speed = 0;
    double acceleration = 0;
    MonoNs t = kSecond;
    MonoNs next_read = kSecond;
    int readings = 0;
    while (readings < 20'000) {
      if (random() % 100 == 0)
        acceleration = kMaxAcceleration * (random() % 4 == 0 ? (any(random) > 0 ? 1 : -1) : any(random));
      const double before = speed;
      speed = std::clamp(speed + acceleration * 17e-6, -kMaxSpeed, kMaxSpeed);
      angle += (before + speed) / 2 * 17e-6;
      t += 17 * kMicrosecond;
      if (t < next_read) continue;
      next_read += period;
      const double noise = any(random) * kNoise / 2;
      const auto width = static_cast<MonoNs>(random() % 10'000) + 100;
      const auto early = static_cast<MonoNs>(random() % static_cast<std::uint64_t>(width));
      const UnwrappedSample sample{static_cast<std::int64_t>(std::floor(angle * scale + noise)),
                                   {t - early, t - early + width}};
      ++readings;
      if (judge.Last() == nullptr) {
        (void)judge.TakeDoubtful(sample);
        continue;
      }
      ASSERT_TRUE(judge.Agrees(sample)) << "period " << period << " reading " << readings;
      judge.Accept(sample, true);
    }
  }
}

TEST(Plausibility, ThreeThatAgreeBecomeTheTruth) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  const MonoNs t = kSecond + kMillisecond;
  EXPECT_FALSE(judge.Agrees(At(t, 60'000)));
  EXPECT_EQ(judge.TakeDoubtful(At(t, 60'000)), Plausibility::Doubt::kImplausible);
  EXPECT_EQ(judge.TakeDoubtful(At(t + kMillisecond, 60'001)), Plausibility::Doubt::kImplausible);
  EXPECT_EQ(judge.TakeDoubtful(At(t + 2 * kMillisecond, 60'002)), Plausibility::Doubt::kAcceptedAfterJump);
  EXPECT_TRUE(judge.Agrees(At(t + 3 * kMillisecond, 60'003)));
}

TEST(Plausibility, ADeviceMayNeedMoreReadingsToBelieveAJump) {
  Plausibility judge(Limits(), 5);
  judge.Accept(At(kSecond, 1'000), false);
  MonoNs t = kSecond + kMillisecond;
  for (int i = 0; i < 4; ++i, t += kMillisecond) {
    EXPECT_EQ(judge.TakeDoubtful(At(t, 60'000)), Plausibility::Doubt::kImplausible) << i;
  }
  EXPECT_EQ(judge.TakeDoubtful(At(t, 60'000)), Plausibility::Doubt::kAcceptedAfterJump);
}

TEST(Plausibility, ReadingsThatDisagreeAmongEachOtherNeverDo) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  for (int i = 1; i < 4; ++i) {
    const UnwrappedSample sample = At(kSecond + i * kMillisecond, i % 2 == 0 ? 65'000 : -65'000);
    ASSERT_FALSE(judge.Agrees(sample));
    EXPECT_EQ(judge.TakeDoubtful(sample), Plausibility::Doubt::kImplausible);
  }
}

TEST(Plausibility, AGoodReadingEndsARun) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  const auto doubt = [&](int ms) { return judge.TakeDoubtful(At(kSecond + ms * kMillisecond, 65'000)); };
  EXPECT_EQ(doubt(1), Plausibility::Doubt::kImplausible);
  EXPECT_EQ(doubt(2), Plausibility::Doubt::kImplausible);
  judge.Accept(At(kSecond + 3 * kMillisecond, 5), true);
  EXPECT_EQ(doubt(4), Plausibility::Doubt::kImplausible);
}

TEST(Plausibility, ReachGrowsWithTime) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  EXPECT_FALSE(judge.Agrees(At(kSecond + kMillisecond, 60'000)));
  EXPECT_TRUE(judge.Agrees(At(kSecond + 5 * kMillisecond, 60'000)));  // 100 turns/s x 5 ms = 65,536
}

TEST(Plausibility, WithoutATruthTwoMustAgree) {
  Plausibility judge(Limits());
  EXPECT_EQ(judge.Last(), nullptr);
  EXPECT_EQ(judge.TakeDoubtful(At(kSecond, 77'000)), Plausibility::Doubt::kFirst);
  EXPECT_EQ(judge.TakeDoubtful(At(kSecond + kMillisecond, 10)), Plausibility::Doubt::kImplausible);
  EXPECT_EQ(judge.TakeDoubtful(At(kSecond + 2 * kMillisecond, 11)), Plausibility::Doubt::kAcceptedAtStart);
}

TEST(Plausibility, AWrongReadingWithinReachIsRepairedWithoutAJump) {
  Plausibility judge(Limits());
  // Turning at full speed, 13,107 counts per ms; the first reading after a gap of 5 ms is damaged.
  Start(judge, At(kSecond, 0));
  for (int i = 1; i <= 5; ++i) {
    ASSERT_TRUE(judge.Agrees(At(kSecond + i * 51 * kMicrosecond, i * 668)));
    judge.Accept(At(kSecond + i * 51 * kMicrosecond, i * 668), true);
  }
  EXPECT_FALSE(judge.Agrees(At(kSecond + 6 * 51 * kMicrosecond, 5 * 668 - 600))) << "without the gap it is seen";
  const UnwrappedSample wrong = At(kSecond + 103 * 51 * kMicrosecond, 103 * 668 - 15'000);
  ASSERT_TRUE(judge.Agrees(wrong));
  judge.Accept(wrong, true);
  for (int i = 104; i < 106; ++i) {
    const UnwrappedSample sample = At(kSecond + i * 51 * kMicrosecond, i * 668);
    ASSERT_FALSE(judge.Agrees(sample));
    EXPECT_EQ(judge.TakeDoubtful(sample), Plausibility::Doubt::kImplausible);
  }
  EXPECT_EQ(judge.TakeDoubtful(At(kSecond + 106 * 51 * kMicrosecond, 106 * 668)),
            Plausibility::Doubt::kPreviousWasWrong);
}

// TS5669 spec 6.4, FS: 5 bits, then a jump to the full resolution.
TEST(Plausibility, LowAccuracyMayBeOffByOnePartIn32) {
  Plausibility judge(Limits());
  UnwrappedSample low = At(kSecond, 0);
  low.low_accuracy = true;
  Start(judge, low);
  EXPECT_TRUE(judge.Agrees(At(kSecond + 51 * kMicrosecond, kTurn / 32)));
  EXPECT_TRUE(judge.Agrees(At(kSecond + 51 * kMicrosecond, -kTurn / 32)));
  EXPECT_FALSE(judge.Agrees(At(kSecond + 51 * kMicrosecond, kTurn / 16)));
}

TEST(Plausibility, TheJumpThatEndsLowAccuracyIsNotImplausible) {
  Plausibility judge(Limits());
  UnwrappedSample low = At(kSecond, 0);
  low.low_accuracy = true;
  Start(judge, low);
  EXPECT_EQ(judge.TakeDoubtful(At(kSecond + 51 * kMicrosecond, kTurn / 8)), Plausibility::Doubt::kFirst);
  EXPECT_EQ(judge.TakeDoubtful(At(kSecond + 102 * kMicrosecond, kTurn / 8)), Plausibility::Doubt::kAcceptedAtStart);
}

TEST(Plausibility, NothingBecomesTheTruthWhileAJumpIsUnderWay) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  judge.Hold(true);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(judge.TakeDoubtful(At(kSecond + i * 51 * kMicrosecond, 65'000)), Plausibility::Doubt::kImplausible);
  }
  judge.Forget();
  EXPECT_EQ(judge.TakeDoubtful(At(kSecond + kMillisecond, 65'000)), Plausibility::Doubt::kFirst);
  EXPECT_EQ(judge.TakeDoubtful(At(kSecond + 2 * kMillisecond, 65'000)), Plausibility::Doubt::kAcceptedAtStart);
}

TEST(Plausibility, AReadingFromThePastIsJudgedByNoiseAlone) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  EXPECT_TRUE(judge.Agrees(At(kSecond - kMillisecond, 3)));
  EXPECT_FALSE(judge.Agrees(At(kSecond - kMillisecond, 3'000)));
}

constexpr std::int64_t kTolerance = 36 + 2 * 4;  // 0.1 degrees of 17 bits, and twice the noise

class StandstillTest : public testing::Test {
 protected:
  // Readings of a shaft at standstill, `period` apart, over `duration`.
  void Rest(MonoNs duration, MonoNs period, bool continuous = true) {
    for (const MonoNs end = t_ + duration; t_ < end; t_ += period) judge_.Add(At(t_, counts_), continuous);
  }
  Motion Now(MonoNs later = 0) { return judge_.At(t_ + later); }

  Standstill judge_{kTurn, 4};
  MonoNs t_ = kSecond;
  std::int64_t counts_ = 1'000;
};

TEST_F(StandstillTest, NothingIsKnownAtFirst) {
  EXPECT_FALSE(Now().known);
  Rest(39 * kMillisecond, kMillisecond);
  EXPECT_FALSE(Now().known);
  EXPECT_FALSE(Now().standstill);
}

TEST_F(StandstillTest, FortyMillisecondsOfRest) {
  Rest(41 * kMillisecond, kMillisecond);
  EXPECT_TRUE(Now().known);
  EXPECT_TRUE(Now().standstill);
  EXPECT_EQ(Now().counts, 1'000);
}

TEST_F(StandstillTest, AtTheFullRateOfTheWire) {
  Rest(41 * kMillisecond, 51 * kMicrosecond);
  EXPECT_TRUE(Now().standstill);
  counts_ += kTolerance + 1;
  Rest(51 * kMicrosecond, 51 * kMicrosecond);
  EXPECT_TRUE(Now().known);
  EXPECT_FALSE(Now().standstill);
}

TEST_F(StandstillTest, NoiseIsRestAndMoreIsNot) {
  for (const auto& [spread, still] : {std::pair{kTolerance, true}, std::pair{kTolerance + 1, false}}) {
    judge_.Forget();
    for (int i = 0; i < 60; ++i, t_ += kMillisecond) judge_.Add(At(t_, i % 2 == 0 ? 0 : spread), true);
    EXPECT_EQ(Now().standstill, still) << spread;
    EXPECT_TRUE(Now().known);
  }
}

TEST_F(StandstillTest, AnOldReadingTellsNothing) {
  Rest(100 * kMillisecond, kMillisecond);
  EXPECT_TRUE(Now(118 * kMillisecond).standstill);
  EXPECT_FALSE(Now(122 * kMillisecond).known);
}

TEST_F(StandstillTest, ALongGapBeginsAnew) {
  Rest(100 * kMillisecond, kMillisecond);
  t_ += 130 * kMillisecond;
  Rest(2 * kMillisecond, kMillisecond);
  EXPECT_FALSE(Now().known);
}

// T-format resets: ten requests 40 ms apart, whose replies hold no turns (TS5669 spec 8).
TEST_F(StandstillTest, AResetSequenceKeepsWatching) {
  Rest(100 * kMillisecond, kMillisecond);
  for (int request = 0; request < 10; ++request) {
    t_ += 40 * kMillisecond;
    ASSERT_TRUE(Now().standstill) << request;
    judge_.Add(At(t_, counts_), false);
  }
  t_ += 40 * kMillisecond;
  judge_.Add(At(t_, counts_ + 1'000), false);
  EXPECT_TRUE(Now().known);
  EXPECT_FALSE(Now().standstill);
  for (int request = 0; request < 5; ++request) {
    t_ += 40 * kMillisecond;
    judge_.Add(At(t_, counts_ + 1'000), false);
  }
  EXPECT_FALSE(Now().standstill);
}

TEST_F(StandstillTest, TwoReadings40MillisecondsApartSufficeWhereTurnsAreRead) {
  judge_.Add(At(t_, 7), true);
  t_ += 40 * kMillisecond;
  judge_.Add(At(t_, 8), true);
  EXPECT_TRUE(Now().standstill);
}

// 1,500 min-1 read every 40 ms without turns shows the same angle each time.
TEST_F(StandstillTest, AliasesDoNotEstablishStandstill) {
  Rest(2 * kSecond, 40 * kMillisecond, false);
  EXPECT_FALSE(Now().standstill);
}

TEST_F(StandstillTest, TellsTheSpeed) {
  // 60 min-1: one turn a second.
  for (int i = 0; i < 100; ++i, t_ += kMillisecond) judge_.Add(At(t_, i * kTurn / 1'000), true);
  EXPECT_NEAR(Now().speed_rpm, 60, 0.5);
  EXPECT_FALSE(Now().standstill);
  counts_ = 100 * kTurn / 1'000;
  Rest(200 * kMillisecond, kMillisecond);
  EXPECT_EQ(Now().speed_rpm, 0);
  EXPECT_TRUE(Now().standstill);
}

}  // namespace
}  // namespace axlecast
