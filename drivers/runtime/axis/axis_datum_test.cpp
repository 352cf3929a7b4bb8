// Datum, turns and jumps of an axis.
#include <gtest/gtest.h>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <optional>

#include "drivers/runtime/axis/axis.h"
#include "drivers/runtime/axis/axis_fixture.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = TestDevice::kTurn;
constexpr std::int64_t kWhole = TestDevice::kTurn * TestDevice::kRange;
using Kind = AxisReading::Kind;

// ---- datum and turns ----

TEST_F(AxisTest, AFixedDatumOfAnAxisThatTurnsTheOtherWay) {
  device_.config.direction = -1;
  device_.config.datum_counts = 100 * kTurn;
  Make();
  EXPECT_EQ(Settle(kWhole - 99 * kTurn).counts, -kTurn);
}

TEST_F(AxisTest, AFixedDatumFarFromZeroOfAnAxisThatTurnsTheOtherWay) {
  device_.config.direction = -1;
  device_.config.datum_counts = 20'000 * kTurn;
  Make();
  EXPECT_EQ(Settle(kWhole - 20'001 * kTurn).counts, kTurn);
}

TEST_F(AxisTest, TheSameDatumAgainLeavesTheTurnsSure) {
  device_.settings->turns_range = 0;
  Make();
  Read(SingleTurn(100));
  Read(SingleTurn(100));
  Home(50);
  Restore(50);  // as a bridge sends it again after a restart
  EXPECT_TRUE(Has(Read(SingleTurn(100)), position_t::FLAG_TURNS_VALID));
}

TEST_F(AxisTest, ASingleTurnAxisThatMayHaveTurnedUnseenLosesItsReference) {
  device_.settings->turns_range = 0;
  Make();
  Read(SingleTurn(100));
  Read(SingleTurn(100));
  t_ += kSecond;
  Read(SingleTurn(100));
  EXPECT_FALSE(axis_->reference().lost()) << "there is no datum";
  Home(0);
  Read(SingleTurn(100));
  EXPECT_FALSE(axis_->reference().lost());
  t_ += kSecond;
  EXPECT_FALSE(Has(Read(SingleTurn(100)), position_t::FLAG_REFERENCED));
  EXPECT_TRUE(axis_->reference().lost());
}

// The turns are known if the datum was set since the driver counts them without a gap.
TEST_F(AxisTest, ADatumFromBeforeTheCountingLeavesTheTurnsUnknown) {
  device_.settings->turns_range = 0;
  for (const bool gap : {false, true}) {
    for (const bool before : {false, true}) {
      Make();
      Read(SingleTurn(100));
      MonoNs begun = t_ + kMicrosecond;  // the end of the interval of the second reading
      Read(SingleTurn(100));
      if (gap) {
        t_ += kSecond;
        begun = t_ + kMicrosecond;
        Read(SingleTurn(100));
      }
      axis_->SetDatum({50, 1}, begun - (before ? 1 : 0), t_);
      EXPECT_EQ(Has(Read(SingleTurn(100)), position_t::FLAG_TURNS_VALID), !before) << gap;
    }
  }
}

TEST_F(AxisTest, ADatumBeforeTheFirstReadingLeavesTheTurnsUnknown) {
  device_.settings->turns_range = 0;
  Make();
  Home(50);
  Read(SingleTurn(100));
  EXPECT_FALSE(Has(Read(SingleTurn(100)), position_t::FLAG_TURNS_VALID));
  axis_->OnJump();  // the encoder counts from 0 now
  Read(SingleTurn(0));
  EXPECT_TRUE(Has(Read(SingleTurn(0)), position_t::FLAG_TURNS_VALID));
}

TEST_F(AxisTest, ADatumThatMovesTheCountingLeavesSpeedAndStandstillUnknown) {
  for (const bool moves : {false, true}) {
    Make();
    for (int ms = 0; ms < 60; ++ms) Read(kWhole - 2 * kTurn);
    ASSERT_FALSE(std::isnan(axis_->SpeedRadS()));
    ASSERT_TRUE(axis_->MotionAt(t_).standstill);
    Restore(moves ? 0 : kWhole);
    EXPECT_EQ(std::isnan(axis_->SpeedRadS()), moves);
    EXPECT_EQ(axis_->MotionAt(t_).standstill, !moves);
    EXPECT_EQ(axis_->LastValid()->counts, moves ? -2 * kTurn : kWhole - 2 * kTurn);
  }
}

// ---- readings of reduced accuracy, and jumps ----

TEST_F(AxisTest, AReadingOfReducedAccuracyDoesNotEndAStandstill) {
  Make();
  for (int ms = 0; ms < 60; ++ms) Read(1'000);
  Sample low = ReadingAt(t_, 1'000 + kTurn / 40);
  low.low_accuracy = true;
  EXPECT_EQ(Read(low).kind, Kind::kGood);
  EXPECT_TRUE(axis_->MotionAt(t_).standstill);
  EXPECT_EQ(Read(1'000).kind, Kind::kGood);
  EXPECT_TRUE(axis_->MotionAt(t_).standstill);
}

TEST_F(AxisTest, TheJumpThatEndsReducedAccuracyIsNoReading) {
  device_.settings->turns_range = 0;
  Make();
  const auto low = [this] {
    Sample sample = SingleTurn(0);
    sample.low_accuracy = true;
    return Read(sample);
  };
  low();
  ASSERT_EQ(low().kind, Kind::kGood);
  Restore(5);  // the turns are not known
  EXPECT_EQ(Read(SingleTurn(kTurn / 4)).kind, Kind::kWithheld);
  EXPECT_EQ(axis_->Counts(), std::nullopt);
  const AxisReading reading = Read(SingleTurn(kTurn / 4));
  EXPECT_EQ(reading.kind, Kind::kGood);
  EXPECT_FALSE(Has(reading, position_t::FLAG_TURNS_VALID));
  EXPECT_EQ(axis_->reference().epoch(), 1) << "of the datum";
  EXPECT_EQ(axis_->unexplained_jumps(), 0);
}

TEST_F(AxisTest, AJumpWithoutADatumLosesNoReference) {
  Make();
  for (int ms = 0; ms < 60; ++ms) Read(5 * kTurn);
  for (int i = 0; i < 3; ++i) Read(700 * kTurn);
  EXPECT_EQ(axis_->Counts(), 700 * kTurn);
  EXPECT_FALSE(axis_->reference().lost());
  EXPECT_EQ(axis_->reference().epoch(), 1);
  EXPECT_FALSE(axis_->MotionAt(t_).known) << "it may be another encoder";
  EXPECT_FALSE(axis_->MotionAt(t_).standstill);
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
}

// It turns at 4,800 min-1 and passes half a turn from where it was before the jump.
TEST_F(AxisTest, TheReadingsAfterAJumpAreCountedFromEachOther) {
  device_.settings->turns_range = 0;
  Make();
  Read(SingleTurn(0));
  Read(SingleTurn(0));
  constexpr std::int64_t kPerMillisecond = kTurn * 8 / 100;
  constexpr std::int64_t kFirst = kTurn * 45 / 100;
  EXPECT_EQ(Read(SingleTurn(kFirst)).kind, Kind::kDoubtful);
  EXPECT_EQ(Read(SingleTurn(kFirst + kPerMillisecond)).kind, Kind::kDoubtful);
  const AxisReading reading = Read(SingleTurn(kFirst + 2 * kPerMillisecond));
  EXPECT_EQ(reading.kind, Kind::kGood);
  EXPECT_EQ(reading.counts, kFirst + 2 * kPerMillisecond);
}

TEST_F(AxisTest, AReadingThatEndsAJumpContradictsTheCountingOnce) {
  Make();
  Read(SingleTurn(0));
  Read(SingleTurn(0));
  constexpr std::int64_t kPlace = 5 * kTurn + kTurn * 45 / 100;
  for (int i = 0; i < 2; ++i) EXPECT_EQ(Read(kPlace).kind, Kind::kDoubtful);
  EXPECT_EQ(Read(kPlace).counts, kPlace - 5 * kTurn) << "the first contradiction";
  EXPECT_EQ(Read(kPlace).counts, kPlace - 5 * kTurn) << "the second one";
  EXPECT_EQ(Read(kPlace).counts, kPlace);
}

TEST_F(AxisTest, AfterAnAnnouncedJumpTheStandstillIsUnknown) {
  Make();
  for (int ms = 0; ms < 60; ++ms) Read(5 * kTurn);
  ASSERT_TRUE(axis_->MotionAt(t_).known);
  axis_->OnJump();
  EXPECT_FALSE(axis_->MotionAt(t_).known);
}

// A damaged reading within reach, at full speed: the readings before and after it agree.
TEST_F(AxisTest, ADamagedReadingWithinReachIsRepairedWithoutAnEpoch) {
  Make();
  const auto at = [](MonoNs t) { return (t - kSecond) * 13'107 / kMillisecond; };
  while (t_ < kSecond + 20 * kMillisecond) Read(at(t_));
  Home(0);
  const std::int32_t epoch = axis_->reference().epoch();
  t_ += 5 * kMillisecond;
  ASSERT_EQ(Read(at(t_) - 15'000).kind, Kind::kGood);
  EXPECT_EQ(Read(at(t_)).kind, Kind::kDoubtful);
  EXPECT_EQ(Read(at(t_)).kind, Kind::kDoubtful);
  const AxisReading repaired = Read(at(t_));
  EXPECT_EQ(repaired.kind, Kind::kGood);
  EXPECT_EQ(repaired.counts, at(t_ - kMillisecond));
  EXPECT_EQ(axis_->Counts(), repaired.counts);
  EXPECT_EQ(axis_->reference().epoch(), epoch);
  EXPECT_EQ(axis_->unexplained_jumps(), 0);
  EXPECT_TRUE(Has(repaired, position_t::FLAG_REFERENCED));
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
}

}  // namespace
}  // namespace axlecast
