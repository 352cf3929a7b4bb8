#include "drivers/runtime/axis/motion.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = 1 << 17;
constexpr std::int64_t kTolerance = 36 + 2 * 4;  // 0.1 degrees of 17 bits, and twice the noise

UnwrappedSample At(MonoNs at, std::int64_t counts) { return {counts, {at, at}}; }

class StandstillTest : public testing::Test {
 protected:
  // Readings of a shaft that stands, `period` apart, over `duration`.
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
