#include <gtest/gtest.h>
#include <cmath>
#include <memory>
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

// Readings at rest, 1 ms apart. Two of them and the next one allow 2 x 5 counts; two that are 2 ms apart allow 7.5.
TEST(Plausibility, OfAHeavyAxisIsComparedWithReadingsOfLongerAgo) {
  Plausibility judge(MotionLimits(kTurn, 3'000, 10, kNoise));
  const auto at = [](int ms, std::int64_t counts) { return At(kSecond + ms * kMillisecond, counts); };
  judge.Accept(at(0, 0), false);
  judge.Accept(at(1, 0), true);
  EXPECT_TRUE(judge.Agrees(at(2, 9)));
  judge.Accept(at(2, 0), true);
  EXPECT_TRUE(judge.Agrees(at(3, 7)));
  EXPECT_FALSE(judge.Agrees(at(3, 9)));
  EXPECT_FALSE(judge.Agrees(at(3, -9)));
}

// It begins to move by 5 counts in each reading, which two readings may differ by.
TEST(Plausibility, OfAHeavyAxisDoubtsADriftWithinItsNoise) {
  Plausibility judge(MotionLimits(kTurn, 3'000, 10, kNoise));
  for (int ms = 0; ms < 3; ++ms) judge.Accept(At(kSecond + ms * kMillisecond, 0), ms > 0);
  const auto at = [](int reading) {
    return At(kSecond + 3 * kMillisecond + (reading - 2) * 51 * kMicrosecond, reading * 5);
  };
  for (int reading = 0; reading <= 2; ++reading) {
    ASSERT_TRUE(judge.Agrees(at(reading))) << reading;
    judge.Accept(at(reading), true);
  }
  EXPECT_FALSE(judge.Agrees(at(3)));
}

// It moves by 5 counts in each of the last 8 readings: too much since 1 ms ago, not since 2 ms ago.
TEST(Plausibility, AReadingIsComparedWithTheNewestThatIsAMillisecondOld) {
  for (const MonoNs late : {-1, 0}) {
    Plausibility judge(MotionLimits(kTurn, 3'000, 1'000, kNoise));
    for (int ms = 0; ms < 3; ++ms) judge.Accept(At(kSecond + ms * kMillisecond, 0), ms > 0);
    const MonoNs last = kSecond + 3 * kMillisecond + late;
    for (int reading = 1; reading < 8; ++reading) {
      const UnwrappedSample sample = At(last - (8 - reading) * 51 * kMicrosecond, reading * 5);
      ASSERT_TRUE(judge.Agrees(sample)) << reading;
      judge.Accept(sample, true);
    }
    EXPECT_EQ(judge.Agrees(At(last, 40)), late < 0);
  }
}

// Rest until 1.1 ms after the first reading of unknown distance, and then 5 counts in each of 8 readings.
TEST(Plausibility, TheComparisonBeginsWithTheFirstReadingOfUnknownDistance) {
  Plausibility judge(MotionLimits(kTurn, 3'000, 10, kNoise));
  judge.Accept(At(kSecond, 0), false);
  judge.Accept(At(kSecond + 100 * kMicrosecond, 0), false);
  judge.Accept(At(kSecond + 1'000 * kMicrosecond, 0), true);
  judge.Accept(At(kSecond + 1'100 * kMicrosecond, 0), true);
  const auto at = [](int reading) {
    return At(kSecond + 2'100 * kMicrosecond - (8 - reading) * 51 * kMicrosecond, reading * 5);
  };
  for (int reading = 1; reading < 8; ++reading) {
    ASSERT_TRUE(judge.Agrees(at(reading))) << reading;
    judge.Accept(at(reading), true);
  }
  EXPECT_FALSE(judge.Agrees(at(8)));
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

TEST(Plausibility, AJumpBetweenReadingsOfLowAccuracyIsImplausible) {
  Plausibility judge(Limits());
  const auto low = [](int reading, std::int64_t counts) {
    UnwrappedSample sample = At(kSecond + reading * 51 * kMicrosecond, counts);
    sample.low_accuracy = true;
    return sample;
  };
  Start(judge, low(0, 0));
  EXPECT_EQ(judge.TakeDoubtful(low(1, kTurn / 4)), Plausibility::Doubt::kImplausible);
  EXPECT_EQ(judge.TakeDoubtful(low(2, kTurn / 4)), Plausibility::Doubt::kImplausible);
  EXPECT_EQ(judge.TakeDoubtful(low(3, kTurn / 4)), Plausibility::Doubt::kAcceptedAfterJump);
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

// ---- limits of the configuration and of the model ----

TEST(MotionLimits, AZeroIsNoLimitAndOneIsALimit) {
  const MotionLimits none(kTurn, 0, 0, kNoise);
  EXPECT_TRUE(none.SpeedAllows(At(0, 0), At(1, INT64_C(1) << 50)));
  EXPECT_TRUE(none.AccelerationAllows(At(0, 0), At(kSecond, 0), At(2 * kSecond, INT64_C(1) << 50)));
  const MotionLimits slow(kTurn, 1, 0, kNoise);  // a turn in 60 s
  EXPECT_TRUE(slow.SpeedAllows(At(0, 0), At(60 * kSecond, kTurn)));
  EXPECT_FALSE(slow.SpeedAllows(At(0, 0), At(60 * kSecond, kTurn + kNoise + 2)));
  const MotionLimits heavy(kTurn, 0, 1, kNoise);  // within 1 s it reaches 1 rad/s
  EXPECT_TRUE(heavy.AccelerationAllows(At(0, 0), At(kSecond, 0), At(2 * kSecond, kTurn / 7)));
  EXPECT_FALSE(heavy.AccelerationAllows(At(0, 0), At(kSecond, 0), At(2 * kSecond, kTurn / 6)));
}

TEST(MotionLimits, TheLimitItselfIsAllowed) {
  const MotionLimits speed(INT64_C(60'000'000'000), 1, 0, 0);  // a count in 1 ns
  EXPECT_TRUE(speed.SpeedAllows(At(0, 0), At(10, 10 + 1)));
  EXPECT_FALSE(speed.SpeedAllows(At(0, 0), At(10, 10 + 2)));
  const MotionLimits acceleration(INT64_C(1'000'000'000'000'000'000), 0, 2 * std::numbers::pi,
                                  0);  // a count in 1 ns2
  EXPECT_TRUE(acceleration.AccelerationAllows(At(0, 0), At(2, 0), At(4, 6)));
  EXPECT_FALSE(acceleration.AccelerationAllows(At(0, 0), At(2, 0), At(4, 7)));
}

// The first two readings may be 1 ns or 20 ms apart, and an error of reduced accuracy is no whole number.
TEST(MotionLimits, AnUncertainTimeAllowsTheSlowestAndTheFastestSpeed) {
  const MotionLimits limits(1'000, 0, kMaxAcceleration, 0);
  UnwrappedSample low = At(kSecond, 0);
  low.low_accuracy = true;
  const Interval late = {kSecond + 1, kSecond + 20 * kMillisecond};
  const MonoNs third = kSecond + 21 * kMillisecond;
  EXPECT_TRUE(limits.AccelerationAllows(low, {33, late}, At(third, 33))) << "three quarters of a count in 20 ms";
  EXPECT_TRUE(limits.AccelerationAllows(low, {-32, late}, At(third, 9'968))) << "a quarter of a count in 1 ns";
}

TEST(MotionLimits, TheConfigurationPrecedesTheModel) {
  const auto settings = std::make_shared<DeviceSettings>();
  settings->counts_per_turn = kTurn;
  settings->max_speed_rpm = 6'000;
  settings->max_accel_rad_s2 = 80'000;
  DeviceConfig device;
  device.settings = settings;
  const auto is_allowed = [&](std::int64_t counts) {
    return MotionLimits(device).SpeedAllows(At(0, 0), At(60 * kSecond, counts));
  };
  const auto is_reached = [&](std::int64_t counts) {
    return MotionLimits(device).AccelerationAllows(At(0, 0), At(kSecond, 0), At(2 * kSecond, counts));
  };
  EXPECT_TRUE(is_allowed(6'000 * kTurn));
  EXPECT_FALSE(is_allowed(6'001 * kTurn));
  EXPECT_TRUE(is_reached(10'000 * kTurn));
  EXPECT_FALSE(is_reached(13'000 * kTurn));
  device.speed_rpm = 1;
  device.accel_rad_s2 = 1;
  EXPECT_TRUE(is_allowed(kTurn));
  EXPECT_FALSE(is_allowed(kTurn + kTurn / 10));
  EXPECT_TRUE(is_reached(kTurn / 7));
  EXPECT_FALSE(is_reached(kTurn / 6));
}

TEST(MotionLimits, TwoReadingsOfReducedAccuracyMayBeOffByOnePartIn16) {
  UnwrappedSample low = At(kSecond, 0);
  low.low_accuracy = true;
  UnwrappedSample next = At(kSecond + 51 * kMicrosecond, kTurn / 16);
  next.low_accuracy = true;
  EXPECT_TRUE(Limits().SpeedAllows(low, next));
  next.counts = kTurn / 16 + 700;  // 51 us at full speed are 668 counts
  EXPECT_FALSE(Limits().SpeedAllows(low, next));
}

TEST(MotionLimits, IntervalsThatTouchMayBeOneInstant) {
  const MotionLimits limits(kTurn, 6'000, 1'000, kNoise);
  const UnwrappedSample a = At(kSecond, 0, kMillisecond);
  const UnwrappedSample b = At(kSecond + 3 * kMillisecond, 13'000, kMillisecond);
  const UnwrappedSample c = At(b.at.last + 10 * kMillisecond, 0);
  EXPECT_FALSE(limits.AccelerationAllows(a, b, c));
  EXPECT_TRUE(limits.AccelerationAllows(a, {b.counts, {a.at.last, b.at.last}}, c));
  EXPECT_FALSE(limits.AccelerationAllows(a, {b.counts, {a.at.last + 1, b.at.last}}, c));
  EXPECT_TRUE(limits.AccelerationAllows(a, b, {0, {b.at.last, c.at.last}}));
  EXPECT_FALSE(limits.AccelerationAllows(a, b, {0, {b.at.last + 1, c.at.last}}));
}

// ---- the speed ----

class SpeedTest : public testing::Test {
 protected:
  // Readings `period` apart of a shaft that moves `step` counts per ms.
  void Turn(MonoNs duration, MonoNs period, std::int64_t step, MonoNs half_width = 0) {
    for (const MonoNs end = t_ + duration; t_ < end;) {
      t_ += period;
      counts_ += step * period / kMillisecond;
      speed_.Add(At(t_, counts_, half_width));
    }
  }

  Speed speed_;
  MonoNs t_ = kSecond;
  std::int64_t counts_ = 0;
};

TEST_F(SpeedTest, NeedsTwoReadingsThatAreAMillisecondApart) {
  EXPECT_TRUE(std::isnan(speed_.CountsPerSecond()));
  speed_.Add(At(kSecond, 0));
  EXPECT_TRUE(std::isnan(speed_.CountsPerSecond()));
  speed_.Add(At(kSecond + kMillisecond - 1, 100));
  EXPECT_TRUE(std::isnan(speed_.CountsPerSecond()));
  speed_.Add(At(kSecond + kMillisecond, 100));
  EXPECT_FALSE(std::isnan(speed_.CountsPerSecond()));
  speed_.Forget();
  EXPECT_TRUE(std::isnan(speed_.CountsPerSecond()));
  speed_.Add(At(2 * kSecond, 0));
  speed_.Add(At(2 * kSecond + kMillisecond, -70));
  EXPECT_DOUBLE_EQ(speed_.CountsPerSecond(), -70'000);
}

TEST_F(SpeedTest, TheTimestampsMayBeUncertainByAQuarterOfTheTime) {
  speed_.Add(At(kSecond, 0, kMillisecond));
  speed_.Add(At(kSecond + 8 * kMillisecond, 800, kMillisecond));
  EXPECT_DOUBLE_EQ(speed_.CountsPerSecond(), 100'000);
  speed_.Forget();
  speed_.Add(At(kSecond, 0, kMillisecond));
  speed_.Add(At(kSecond + 8 * kMillisecond - 1, 800, kMillisecond));
  EXPECT_TRUE(std::isnan(speed_.CountsPerSecond()));
}

// A shaft that begins to turn: what is older than the stated time does not count any more.
TEST_F(SpeedTest, ItIsOfTheLast8MillisecondsIfReadingsComeFast) {
  Turn(100 * kMillisecond, 100 * kMicrosecond, 0);
  Turn(9 * kMillisecond, 100 * kMicrosecond, 100);
  EXPECT_NEAR(speed_.CountsPerSecond(), 100'000, 1e-6);
  Turn(5 * kMillisecond, 100 * kMicrosecond, 0);
  EXPECT_LT(speed_.CountsPerSecond(), 90'000);
  EXPECT_GT(speed_.CountsPerSecond(), 1'000) << "it covers more than 5 ms";
}

TEST_F(SpeedTest, ItIsOfTheLast20MillisecondsIfReadingsComeSlowly) {
  Turn(100 * kMillisecond, 4 * kMillisecond, 0);
  Turn(20 * kMillisecond, 4 * kMillisecond, 100);
  EXPECT_NEAR(speed_.CountsPerSecond(), 100'000, 1e-6);
  Turn(16 * kMillisecond, 4 * kMillisecond, 0);
  EXPECT_GT(speed_.CountsPerSecond(), 1'000) << "it covers more than 16 ms";
  Turn(4 * kMillisecond, 4 * kMillisecond, 0);
  EXPECT_NEAR(speed_.CountsPerSecond(), 0, 1e-6);
}

TEST_F(SpeedTest, ItIsOfUpToHalfASecondIfTheTimestampsAreUncertain) {
  constexpr MonoNs kUncertain = 62'500 * kMicrosecond;
  speed_.Add(At(kSecond, 0, kUncertain));
  speed_.Add(At(kSecond + 500 * kMillisecond, 5'000, kUncertain));
  EXPECT_DOUBLE_EQ(speed_.CountsPerSecond(), 10'000);
  speed_.Forget();
  speed_.Add(At(kSecond, 0, kUncertain));
  speed_.Add(At(kSecond + 500 * kMillisecond + 1, 5'000, kUncertain));
  EXPECT_TRUE(std::isnan(speed_.CountsPerSecond())) << "the first one is too old";
}

// Least squares of four readings: t = 0, 1, 2, 3 ms and x = 0, 3, 3, 6.
TEST_F(SpeedTest, ItIsTheSlopeOfTheLineThatFitsBest) {
  const std::int64_t counts[] = {0, 3, 3, 6};
  for (const std::int64_t x : counts) {
    speed_.Add(At(t_, x));
    t_ += kMillisecond;
  }
  EXPECT_NEAR(speed_.CountsPerSecond(), 1'800, 1e-9);
}

TEST_F(SpeedTest, TheLastReadingCountsEvenIfItIsCloseToTheOneBefore) {
  speed_.Add(At(kSecond, 0));
  speed_.Add(At(kSecond + 700 * kMicrosecond, 70));
  EXPECT_TRUE(std::isnan(speed_.CountsPerSecond()));
  speed_.Add(At(kSecond + 1'100 * kMicrosecond, 110));
  EXPECT_NEAR(speed_.CountsPerSecond(), 100'000, 1e-6);
  speed_.Add(At(kSecond + 1'150 * kMicrosecond, 215));
  EXPECT_GT(speed_.CountsPerSecond(), 120'000);
}

TEST_F(SpeedTest, AReadingCloseToTheOneBeforeIsUsedAsTheLastOneOnly) {
  speed_.Add(At(kSecond, 0));
  speed_.Add(At(kSecond + 100 * kMicrosecond, 50));
  speed_.Add(At(kSecond + 1'100 * kMicrosecond, 110));
  EXPECT_NEAR(speed_.CountsPerSecond(), 100'000, 1e-6);
}

TEST_F(SpeedTest, ItBeginsWithTheFirstReadingAfterAJump) {
  speed_.Add(At(kSecond, 0));
  speed_.Forget();
  speed_.Add(At(kSecond + 100 * kMicrosecond, 0));
  speed_.Add(At(kSecond + 1'100 * kMicrosecond, 100));
  EXPECT_NEAR(speed_.CountsPerSecond(), 100'000, 1e-6);
}

TEST_F(SpeedTest, ItIsAsExactFarFromZero) {
  counts_ = INT64_C(1) << 52;
  Turn(20 * kMillisecond, kMillisecond, 100);
  EXPECT_NEAR(speed_.CountsPerSecond(), 100'000, 1e-6);
}

// ---- more about plausibility ----

TEST(Plausibility, OnlyTheReadingBeforeTheLastRepairsIt) {
  Plausibility judge(Limits());
  judge.Accept(At(kSecond, 0), false);
  judge.Accept(At(kSecond + 20 * kMillisecond, 60'000), false);  // how far it went in between is not known
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(judge.TakeDoubtful(At(kSecond + (21 + i) * kMillisecond, 0)), Plausibility::Doubt::kImplausible);
  }
  EXPECT_EQ(judge.TakeDoubtful(At(kSecond + 23 * kMillisecond, 0)), Plausibility::Doubt::kAcceptedAfterJump);
}

TEST(Plausibility, AReadingOfUnknownDistanceBeginsAnew) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  for (int i = 1; i <= 10; ++i) judge.Accept(At(kSecond + i * kMillisecond, i * 10'000), true);
  judge.Accept(At(kSecond + 30 * kMillisecond, 0), false);
  EXPECT_TRUE(judge.Agrees(At(kSecond + 31 * kMillisecond, 0))) << "the speed of before does not count";
  judge.Accept(At(kSecond + 31 * kMillisecond, 0), true);
  EXPECT_TRUE(judge.Agrees(At(kSecond + 32 * kMillisecond, 0)));
}

TEST(Plausibility, ACountingFromAnotherTurnMovesAllThatIsCompared) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  const MonoNs t = kSecond + kMillisecond;
  EXPECT_EQ(judge.TakeDoubtful(At(t, 60'000)), Plausibility::Doubt::kImplausible);
  EXPECT_EQ(judge.TakeDoubtful(At(t + kMillisecond, 60'000)), Plausibility::Doubt::kImplausible);
  judge.Shift(kTurn);
  EXPECT_EQ(judge.Last()->counts, kTurn);
  EXPECT_TRUE(judge.Agrees(At(t + 2 * kMillisecond, kTurn)));
  EXPECT_EQ(judge.TakeDoubtful(At(t + 2 * kMillisecond, kTurn + 60'000)), Plausibility::Doubt::kAcceptedAfterJump);
}

TEST(Plausibility, ACountingFromAnotherTurnLeavesTheOlderReadingsOut) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  for (int ms = 1; ms <= 3; ++ms) judge.Accept(At(kSecond + ms * kMillisecond, 0), true);
  judge.Shift(kTurn);
  EXPECT_TRUE(judge.Agrees(At(kSecond + 4 * kMillisecond, kTurn)));
}

TEST(Plausibility, AfterAnAnnouncedJumpTheConfirmationsBeginAnew) {
  Plausibility judge(Limits());
  Start(judge, At(kSecond, 0));
  const auto doubt = [&](int ms) { return judge.TakeDoubtful(At(kSecond + ms * kMillisecond, 65'000)); };
  EXPECT_EQ(doubt(1), Plausibility::Doubt::kImplausible);
  EXPECT_EQ(doubt(2), Plausibility::Doubt::kImplausible);
  judge.Hold(true);
  judge.Hold(false);
  EXPECT_EQ(judge.Doubted(), nullptr);
  EXPECT_EQ(doubt(3), Plausibility::Doubt::kImplausible);
  EXPECT_EQ(doubt(4), Plausibility::Doubt::kImplausible);
  judge.Forget();
  EXPECT_EQ(judge.Last(), nullptr);
  EXPECT_EQ(judge.Doubted(), nullptr);
  EXPECT_EQ(doubt(5), Plausibility::Doubt::kFirst);
}

}  // namespace
}  // namespace axlecast
