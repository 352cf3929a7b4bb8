#include <gtest/gtest.h>

#include "drivers/runtime/axis/motion.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = 1 << 17;
constexpr std::int64_t kTolerance = 36 + 2 * 4;  // 0.1 degrees of 17 bits, and twice the noise

UnwrappedSample At(MonoNs at, std::int64_t counts) { return {counts, {at, at}}; }

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

// ---- the begin and the end of a standstill ----

TEST_F(StandstillTest, AReadingOf120MillisecondsIsTheOldestThatCounts) {
  Rest(100 * kMillisecond, kMillisecond);
  const MonoNs last = t_ - kMillisecond;
  EXPECT_TRUE(judge_.At(last + Standstill::kOldest).standstill);
  const Motion old = judge_.At(last + Standstill::kOldest + 1);
  EXPECT_FALSE(old.standstill);
  EXPECT_FALSE(old.known);
  EXPECT_EQ(old.counts, counts_) << "the last position remains";
  EXPECT_EQ(old.at, last);
}

TEST_F(StandstillTest, AGapOf120MillisecondsContinuesAStandstillAndALongerOneEndsIt) {
  for (const bool longer : {false, true}) {
    judge_.Forget();
    Rest(41 * kMillisecond, kMillisecond);
    t_ += Standstill::kOldest - kMillisecond + (longer ? 1 : 0);
    judge_.Add(At(t_, counts_), true);
    EXPECT_EQ(Now().standstill, !longer);
    EXPECT_EQ(Now().known, !longer);
  }
}

TEST_F(StandstillTest, TheReadingsMustCover40Milliseconds) {
  judge_.Add(At(t_, 7), true);
  judge_.Add(At(t_ + 40 * kMillisecond - 1, 7), true);
  EXPECT_FALSE(Now().standstill);
  judge_.Add(At(t_ + 40 * kMillisecond, 7), true);
  EXPECT_TRUE(Now().standstill);
}

TEST_F(StandstillTest, ACoarseEncoderMayFlickerByTwoCounts) {
  for (const std::int64_t spread : {2, 3}) {
    Standstill coarse(1'024, 0);
    for (int ms = 0; ms <= 60; ++ms) coarse.Add(At(ms * kMillisecond, ms % 2 == 0 ? 0 : spread), true);
    EXPECT_EQ(coarse.At(60 * kMillisecond).standstill, spread == 2) << spread;
  }
}

TEST_F(StandstillTest, ANoisyEncoderMayFlickerByTwiceItsNoise) {
  for (const std::int64_t spread : {2 * 50 + 2, 2 * 50 + 3}) {
    Standstill noisy(1'024, 50);
    for (int ms = 0; ms <= 60; ++ms) noisy.Add(At(ms * kMillisecond, ms % 2 == 0 ? 0 : spread), true);
    EXPECT_EQ(noisy.At(60 * kMillisecond).standstill, spread == 2 * 50 + 2) << spread;
  }
}

TEST_F(StandstillTest, AMotionIsKnownAfter40MillisecondsOfReadings) {
  judge_.Add(At(t_, 0), true);
  judge_.Add(At(t_ + 40 * kMillisecond - 1, 10'000), true);
  EXPECT_FALSE(judge_.At(t_ + 40 * kMillisecond).known);
  judge_.Add(At(t_ + 40 * kMillisecond, 10'000), true);
  EXPECT_TRUE(judge_.At(t_ + 40 * kMillisecond).known);
  EXPECT_FALSE(judge_.At(t_ + 40 * kMillisecond).standstill);
}

TEST_F(StandstillTest, AShaftThatStopsIsAtRestAfter40Milliseconds) {
  for (int i = 0; i < 100; ++i, t_ += kMillisecond) judge_.Add(At(t_, i * 1'000), true);
  counts_ = 99'000;
  Rest(39 * kMillisecond, kMillisecond);
  EXPECT_FALSE(Now().standstill);
  EXPECT_TRUE(Now().known);
  Rest(2 * kMillisecond, kMillisecond);
  EXPECT_TRUE(Now().standstill);
}

TEST_F(StandstillTest, AShaftThatStopsAfterItTurnedDownwardsIsAtRest) {
  for (int i = 0; i < 100; ++i, t_ += kMillisecond) judge_.Add(At(t_, -i * 1'000), true);
  counts_ = -99'000;
  Rest(41 * kMillisecond, kMillisecond);
  EXPECT_TRUE(Now().standstill);
}

TEST_F(StandstillTest, TheToleranceIsFromTheLowestToTheHighestReading) {
  for (const std::int64_t first : {1, -1}) {
    judge_.Forget();
    for (const std::int64_t counts : {INT64_C(0), first * kTolerance * 2 / 3, -first * kTolerance * 2 / 3}) {
      judge_.Add(At(t_, counts), true);
      t_ += 20 * kMillisecond;
    }
    EXPECT_FALSE(Now().standstill) << first;
  }
}

TEST_F(StandstillTest, AfterALongGapMotionAndSpeedOfBeforeDoNotCount) {
  for (int i = 0; i < 60; ++i, t_ += kMillisecond) judge_.Add(At(t_, i * 1'000), true);
  EXPECT_GT(Now().speed_rpm, 0);
  t_ += 130 * kMillisecond;
  judge_.Add(At(t_, counts_), false);
  EXPECT_EQ(Now().speed_rpm, 0);
  t_ += 40 * kMillisecond;
  Rest(81 * kMillisecond, 40 * kMillisecond, false);
  EXPECT_FALSE(Now().known) << "the same angle each time may be a whole turn";
}

// The speed is the largest over 5 ms or more, in the present 40 ms and those before.
TEST_F(StandstillTest, TheLargestSpeedRemainsForTwiceTheTime) {
  Standstill judge(60'000, 0);  // 1 count per ms is 1 min-1
  MonoNs t = kSecond;
  std::int64_t counts = 60'000'000;
  const auto turn = [&](int milliseconds, std::int64_t step) {
    for (int ms = 0; ms < milliseconds; ++ms) {
      judge.Add(At(t, counts), true);
      t += kMillisecond;
      counts += step;
    }
    return judge.At(t).speed_rpm;
  };
  EXPECT_DOUBLE_EQ(turn(5, 100), 0) << "less than 5 ms";
  EXPECT_DOUBLE_EQ(turn(5, 100), 100);
  EXPECT_DOUBLE_EQ(turn(11, -300), 300);
  EXPECT_DOUBLE_EQ(turn(20, 0), 300) << "of the 40 ms before";
  EXPECT_DOUBLE_EQ(turn(39, 0), 300);
  EXPECT_DOUBLE_EQ(turn(1, 0), 0);
}

}  // namespace
}  // namespace axlecast
