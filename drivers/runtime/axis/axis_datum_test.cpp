#include <gtest/gtest.h>

#include <cmath>

#include "drivers/runtime/axis/axis_fixture.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = TestDevice::kTurn;
constexpr std::int64_t kWhole = TestDevice::kTurn * TestDevice::kRange;
using Kind = AxisReading::Kind;

TEST_F(AxisTest, DirectionAndDatum) {
  for (const int direction : {1, -1}) {
    for (const bool ccw : {true, false}) {
      device_.config.direction = direction;
      device_.settings->ccw_increases = ccw;
      Make();
      Settle(1'000);
      const std::int64_t sign = direction * (ccw ? 1 : -1);
      Home(sign * 400);
      EXPECT_EQ(Read(1'000).counts, sign * 600);
      EXPECT_EQ(Read(1'001).counts - sign * 600, sign);
    }
  }
}

TEST_F(AxisTest, DatumForAValue) {
  device_.config.unit = position_t::UNIT_MM;
  device_.config.per_turn = 5;
  Make();
  EXPECT_EQ(axis_->DatumFor(1), std::nullopt);
  Settle(10 * kTurn);
  const auto datum = axis_->DatumFor(123.45);
  ASSERT_TRUE(datum.has_value());
  Home(*datum);
  EXPECT_NEAR(axis_->scale().Value(Read(10 * kTurn).counts), 123.45, 5.0 / kTurn);
  EXPECT_EQ(axis_->DatumFor(std::nan("")), std::nullopt);
  EXPECT_EQ(axis_->DatumFor(1e300), std::nullopt);
}

TEST_F(AxisTest, EachDatumIsANewEpochButTheSameOneIsNot) {
  Make();
  Settle(0);
  Home(10);
  EXPECT_EQ(axis_->reference().epoch(), 1);
  Home(10);
  EXPECT_EQ(axis_->reference().epoch(), 1);
  Home(11);
  EXPECT_EQ(axis_->reference().epoch(), 2);
}

TEST_F(AxisTest, AfterARestartTheReadingNearestToTheDatumIsTaken) {
  Make();
  Settle(kWhole - 2 * kTurn);  // the axis stands two turns below its datum, which was set at turn 0
  Restore(0);
  const AxisReading reading = Read(kWhole - 2 * kTurn);
  EXPECT_EQ(reading.kind, Kind::kGood);
  EXPECT_EQ(reading.counts, -2 * kTurn);
  EXPECT_TRUE(Has(reading, position_t::FLAG_REFERENCED));
}

TEST_F(AxisTest, AFixedDatumHoldsFromTheFirstReading) {
  device_.config.datum_counts = 100 * kTurn;
  Make();
  const AxisReading reading = Settle(99 * kTurn);
  EXPECT_EQ(reading.counts, -kTurn);
  EXPECT_TRUE(Has(reading, position_t::FLAG_REFERENCED));
}

TEST_F(AxisTest, ASingleTurnEncoderOnALinearAxisForgetsItsTurnsInARestart) {
  device_.settings->turns_range = 0;
  Make();
  Read(SingleTurn(0));
  Read(SingleTurn(0));
  Restore(0);  // homed before the restart, moved ten turns since: nobody can tell
  const AxisReading linear = Read(SingleTurn(0));
  EXPECT_TRUE(Has(linear, position_t::FLAG_VALID));
  EXPECT_FALSE(Has(linear, position_t::FLAG_TURNS_VALID));
  EXPECT_FALSE(Has(linear, position_t::FLAG_REFERENCED));
  Home(1);
  EXPECT_TRUE(Has(Read(SingleTurn(0)), position_t::FLAG_REFERENCED));
}

TEST_F(AxisTest, ARotaryTableNeedsNoTurns) {
  device_.settings->turns_range = 0;
  device_.config.unit = position_t::UNIT_DEG;
  device_.config.per_turn = 360;
  device_.config.modulo = 360;
  Make();
  Read(SingleTurn(0));
  Read(SingleTurn(0));
  Restore(0);
  EXPECT_TRUE(Has(Read(SingleTurn(0)), position_t::FLAG_REFERENCED));
  t_ += kSecond;  // turns are lost, the angle is not
  const AxisReading reading = Read(SingleTurn(kTurn / 4));
  EXPECT_FALSE(Has(reading, position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(reading, position_t::FLAG_REFERENCED));
  EXPECT_DOUBLE_EQ(axis_->scale().Value(reading.counts), 90);
}

TEST_F(AxisTest, ReferenceLostPersistsUntilADatumOrTheDeviceRestoresIt) {
  Make();
  Settle(0);
  Home(10);
  EXPECT_TRUE(Has(Read(0), position_t::FLAG_REFERENCED));
  axis_->OnReferenceLost(t_);
  const AxisReading lost = Read(0);
  EXPECT_TRUE(Has(lost, position_t::FLAG_VALID));
  EXPECT_FALSE(Has(lost, position_t::FLAG_REFERENCED));
  EXPECT_FALSE(Has(lost, position_t::FLAG_TURNS_VALID));
  Restore(11);  // a datum from before the loss, as a bridge may send it again
  EXPECT_TRUE(axis_->reference().lost());
  Home(12);
  EXPECT_TRUE(Has(Read(0), position_t::FLAG_REFERENCED));
  axis_->OnReferenceLost(t_);
  axis_->OnReferenceRestored();
  EXPECT_TRUE(Has(Read(0), position_t::FLAG_REFERENCED));
}

TEST_F(AxisTest, AnAnnouncedJumpDropsTheDatum) {
  Make();
  Settle(50 * kTurn);
  Home(50 * kTurn);
  axis_->OnDatumChanging(true);
  const AxisReading moved = Read(0);  // the device was reset, the driver has not confirmed it yet
  EXPECT_EQ(moved.kind, Kind::kDoubtful);
  EXPECT_TRUE(Has(moved, position_t::FLAG_DATUM_CHANGING));
  for (int i = 0; i < 5; ++i) EXPECT_EQ(Read(0).kind, Kind::kDoubtful);
  const std::int32_t epoch = axis_->reference().epoch();
  axis_->OnJump();
  axis_->OnDatumChanging(false);
  EXPECT_EQ(axis_->reference().epoch(), epoch + 1);
  const AxisReading reading = Settle(0);
  EXPECT_EQ(reading.counts, 0);
  EXPECT_FALSE(axis_->reference().lost());
  EXPECT_EQ(reading.flags, kUsable);
  EXPECT_EQ(axis_->unexplained_jumps(), 0);
}

TEST_F(AxisTest, AWildDatumDoesNotOverflow) {
  Make();
  Settle(kTurn);
  for (const std::int64_t wild : {INT64_MIN, INT64_MAX}) {
    Home(wild);
    Restore(wild);
    EXPECT_EQ(Read(kTurn).kind, Kind::kGood);
    (void)axis_->DatumFor(1e15);
  }
}

TEST_F(AxisTest, CountsOutOfRangeAreTakenModuloTheTurn) {
  Make();
  Sample sample = ReadingAt(t_, 0);
  sample.counts = -1;
  sample.turns = -1;
  Read(sample);
  sample.at = ReadingAt(t_, 0).at;
  EXPECT_EQ(Read(sample).counts, kWhole - 1);
}

}  // namespace
}  // namespace axlecast
