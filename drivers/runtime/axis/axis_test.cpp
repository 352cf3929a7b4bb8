#include <gtest/gtest.h>
#include <axlecast/position_t.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <utility>

#include "drivers/runtime/axis/axis.h"
#include "drivers/runtime/axis/axis_fixture.h"
#include "drivers/runtime/axis/motion.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = TestDevice::kTurn;
constexpr std::int64_t kWhole = TestDevice::kTurn * TestDevice::kRange;
using Kind = AxisReading::Kind;

TEST_F(AxisTest, TheFirstReadingWaitsForTheSecond) {
  Make();
  EXPECT_EQ(Read(1'000).kind, Kind::kWithheld);
  const AxisReading second = Read(1'001);
  EXPECT_EQ(second.kind, Kind::kGood);
  EXPECT_EQ(second.counts, 1'001);
  EXPECT_EQ(second.flags, kUsable);
}

struct Walk {
  std::int64_t position;
  double speed = 0;
  // One step of `period` within 6,000 min-1 and 80,000 rad/s2; beyond 100 turns from `home` it turns round.
  void Step(std::mt19937_64& random, MonoNs period, std::int64_t home) {
    const double seconds = static_cast<double>(period) * 1e-9;
    const double counts_per_rad = static_cast<double>(kTurn) / (2 * std::numbers::pi);
    const double maximum = 80'000 * counts_per_rad * seconds * 0.9;
    double change = std::uniform_real_distribution<double>(-maximum, maximum)(random);
    if (position > home + 100 * kTurn) change = -maximum;
    if (position < home - 100 * kTurn) change = maximum;
    speed = std::clamp(speed + change, -100.0 * kTurn * 0.99, 100.0 * kTurn * 0.99);
    position += static_cast<std::int64_t>(speed * seconds);
  }
};

TEST_F(AxisTest, MultiTurnFollowsAWalkOfMillionsAcrossTheEndOfTheCounter) {
  Make();
  std::mt19937_64 random(3);
  Walk walk{kWhole - 3 * kTurn};
  std::int64_t crossings = 0;
  Settle(walk.position);
  for (int i = 0; i < 2'000'000; ++i) {
    const bool above = walk.position >= kWhole;
    walk.Step(random, kMillisecond, kWhole);
    crossings += above != (walk.position >= kWhole) ? 1 : 0;
    const AxisReading reading = Read(walk.position);
    ASSERT_EQ(reading.kind, Kind::kGood) << i;
    ASSERT_EQ(reading.counts, walk.position) << i;
    ASSERT_TRUE(Has(reading, position_t::FLAG_TURNS_VALID));
  }
  EXPECT_GT(crossings, 100);
}

TEST_F(AxisTest, SingleTurnFollowsAWalkOfMillions) {
  device_.settings->turns_range = 0;
  device_.config.direction = -1;
  Make();
  std::mt19937_64 random(4);
  Walk walk{kTurn / 2};
  Read(SingleTurn(walk.position));
  Read(SingleTurn(walk.position));
  for (int i = 0; i < 2'000'000; ++i) {
    walk.Step(random, kMillisecond, 1'000 * kTurn);
    const AxisReading reading = Read(SingleTurn(walk.position));
    ASSERT_EQ(reading.counts, -walk.position) << i;
    ASSERT_EQ(reading.flags, kUsable | position_t::FLAG_TURNS_COUNTED_BY_DRIVER);
  }
  EXPECT_GT(std::abs(walk.position), 100 * kTurn);
}

TEST_F(AxisTest, RepliesWithoutTheCounterAreCountedInBetween) {
  Make();
  std::mt19937_64 random(5);
  Walk walk{1'000 * kTurn};
  Settle(walk.position);
  for (int i = 0; i < 200'000; ++i) {
    walk.Step(random, kMillisecond, 1'000 * kTurn);
    const bool with_turns = i % 7 == 0;
    const AxisReading reading = Read(with_turns ? ReadingAt(t_, walk.position) : SingleTurn(walk.position));
    ASSERT_EQ(reading.counts, walk.position) << i;
    ASSERT_TRUE(Has(reading, position_t::FLAG_TURNS_VALID));
    ASSERT_EQ(Has(reading, position_t::FLAG_TURNS_COUNTED_BY_DRIVER), !with_turns);
  }
}

TEST_F(AxisTest, ModesReadTheCounterAsTheyAreDefined) {
  struct Case {
    TurnsMode mode;
    std::int64_t said;
    std::int64_t counts;
  };
  const Case cases[] = {
      {TurnsMode::kUnsigned, 0, 0},
      {TurnsMode::kUnsigned, 65'535 * kTurn, 65'535 * kTurn},
      {TurnsMode::kSigned, 32'767 * kTurn + 5, 32'767 * kTurn + 5},
      {TurnsMode::kSigned, 32'768 * kTurn, -32'768 * kTurn},
      {TurnsMode::kSigned, 65'535 * kTurn + kTurn - 1, -1},
      {TurnsMode::kModulo, 65'535 * kTurn, 65'535 * kTurn},
  };
  for (const Case& c : cases) {
    device_.config.turns = c.mode;
    Make();
    EXPECT_EQ(Settle(c.said).counts, c.counts);
  }
}

TEST_F(AxisTest, PassingTheEndGoesOnCountingAndSaysSo) {
  struct Case {
    TurnsMode mode;
    std::int64_t end;  // the first count outside
    bool outside;
  };
  const Case cases[] = {{TurnsMode::kUnsigned, kWhole, true},
                        {TurnsMode::kSigned, kWhole / 2, true},
                        {TurnsMode::kModulo, kWhole, false}};
  for (const Case& c : cases) {
    device_.config.turns = c.mode;
    Make();
    const AxisReading inside = Settle(c.end - 1);
    EXPECT_TRUE(Has(inside, position_t::FLAG_TURNS_VALID));
    const AxisReading outside = Read(c.end);
    EXPECT_EQ(outside.counts, c.end);
    EXPECT_EQ(axis_->outside(), c.outside);
    EXPECT_EQ(Has(outside, position_t::FLAG_TURNS_WRAPPED), c.outside);
    EXPECT_EQ(Has(outside, position_t::FLAG_TURNS_VALID), !c.outside);
    EXPECT_TRUE(Has(Read(c.end - 2), position_t::FLAG_TURNS_VALID));  // back again
  }
}

TEST_F(AxisTest, SingleTurnLosesItsTurnsWhenHalfATurnMayHavePassed) {
  device_.settings->turns_range = 0;
  for (const auto& [gap, kept] : {std::pair{4 * kMillisecond, true}, std::pair{6 * kMillisecond, false}}) {
    Make();
    Read(SingleTurn(100));
    Read(SingleTurn(100));
    t_ += gap - kMillisecond;  // half a turn at 6,000 min-1 takes 5 ms
    const AxisReading reading = Read(SingleTurn(100));
    EXPECT_TRUE(Has(reading, position_t::FLAG_VALID));
    EXPECT_EQ(Has(reading, position_t::FLAG_TURNS_VALID), kept);
    EXPECT_EQ(Has(Read(SingleTurn(100)), position_t::FLAG_TURNS_VALID), kept);
    Home(0);
    EXPECT_TRUE(Has(Read(SingleTurn(100)), position_t::FLAG_TURNS_VALID));
  }
}

TEST_F(AxisTest, TheCounterMendsWhatAGapBroke) {
  Make();
  Settle(10 * kTurn);
  Home(0);
  t_ += 20 * kMillisecond;
  const AxisReading unsure = Read(SingleTurn(11 * kTurn));  // one turn in 20 ms is possible
  EXPECT_TRUE(Has(unsure, position_t::FLAG_VALID));
  EXPECT_FALSE(Has(unsure, position_t::FLAG_TURNS_VALID));
  EXPECT_FALSE(Has(unsure, position_t::FLAG_REFERENCED));
  const std::int32_t epoch = axis_->reference().epoch();
  // A single damaged counter must not be accepted; three equal ones are.
  EXPECT_EQ(Read(11 * kTurn).counts, 10 * kTurn);
  EXPECT_EQ(Read(11 * kTurn).counts, 10 * kTurn);
  const AxisReading mended = Read(11 * kTurn);
  EXPECT_EQ(mended.counts, 11 * kTurn);
  EXPECT_TRUE(Has(mended, position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(mended, position_t::FLAG_REFERENCED));
  EXPECT_EQ(axis_->reference().epoch(), epoch + 1);
}

TEST_F(AxisTest, TheCounterConfirmsWhatAGapLeftOpen) {
  Make();
  Settle(10 * kTurn);
  t_ += 20 * kMillisecond;
  EXPECT_FALSE(Has(Read(SingleTurn(10 * kTurn)), position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(Read(10 * kTurn), position_t::FLAG_TURNS_VALID));
  EXPECT_EQ(axis_->reference().epoch(), 0);
}

TEST_F(AxisTest, TurnsThatTheDeviceDoubtsAreCountedAndNotTrusted) {
  Make();
  Settle(5 * kTurn);
  const auto doubted = [&](std::int64_t said) {
    Sample sample = ReadingAt(t_, said);
    sample.turns_trusted = false;
    return sample;
  };
  AxisReading reading = Read(doubted(40'000 * kTurn));  // ME: a bit jumped in the counter
  EXPECT_TRUE(Has(reading, position_t::FLAG_VALID));
  EXPECT_EQ(reading.counts, 5 * kTurn);
  EXPECT_FALSE(Has(reading, position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(reading, position_t::FLAG_TURNS_COUNTED_BY_DRIVER));
  // After a datum the driver's own counting holds, as for an encoder without battery.
  Home(5 * kTurn);
  reading = Read(doubted(40'000 * kTurn));
  EXPECT_EQ(reading.counts, 0);
  EXPECT_TRUE(Has(reading, position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(reading, position_t::FLAG_REFERENCED));
  // The device trusts its counter again, but with another value: the reference is lost.
  for (int i = 0; i < 3; ++i) {
    reading = Read(40'000 * kTurn);
    EXPECT_EQ(reading.kind, Kind::kGood) << "the angle is the same";
  }
  EXPECT_EQ(reading.counts, 40'000 * kTurn - 5 * kTurn - kWhole);  // the short way round
  EXPECT_TRUE(axis_->reference().lost());
  EXPECT_FALSE(Has(reading, position_t::FLAG_REFERENCED));
}

TEST_F(AxisTest, ADoubtedCounterThatIsWithinReachStillTellsTheTurnAfterAGap) {
  Make();
  Settle(5 * kTurn);
  t_ += 7 * kMillisecond;
  Sample sample = ReadingAt(t_, 5 * kTurn + 70'000);  // the short way would be backwards
  sample.turns_trusted = false;
  AxisReading doubted = Read(sample);
  EXPECT_EQ(doubted.counts, 5 * kTurn + 70'000);
  EXPECT_FALSE(Has(doubted, position_t::FLAG_TURNS_VALID));
  t_ += 6 * kMillisecond;
  sample = ReadingAt(t_, 5 * kTurn + 140'000);
  sample.turns_trusted = false;
  doubted = Read(sample);
  EXPECT_EQ(doubted.counts, 5 * kTurn + 140'000);
  const AxisReading trusted = Read(5 * kTurn + 150'000);  // it cannot have stopped within a millisecond
  EXPECT_EQ(trusted.counts, 5 * kTurn + 150'000);
  EXPECT_TRUE(Has(trusted, position_t::FLAG_TURNS_VALID));
  EXPECT_EQ(axis_->reference().epoch(), 0);
}

TEST_F(AxisTest, ADamagedCounterIsImplausible) {
  Make();
  Settle(5 * kTurn);
  const AxisReading reading = Read(6 * kTurn);
  EXPECT_EQ(reading.kind, Kind::kDoubtful);
  EXPECT_EQ(reading.flags, position_t::FLAG_IMPLAUSIBLE + 0);
  EXPECT_EQ(Read(5 * kTurn).kind, Kind::kGood);
}

TEST_F(AxisTest, AnExchangedEncoderIsANewEpochAndLosesTheReference) {
  Make();
  Settle(5 * kTurn);
  Home(0);
  const std::int32_t epoch = axis_->reference().epoch();
  Read(700 * kTurn);
  Read(700 * kTurn);
  EXPECT_EQ(axis_->reference().epoch(), epoch);
  EXPECT_EQ(axis_->Counts(), std::nullopt);
  const AxisReading reading = Read(700 * kTurn);
  EXPECT_EQ(reading.kind, Kind::kGood);
  EXPECT_EQ(reading.counts, 700 * kTurn);
  EXPECT_EQ(axis_->reference().epoch(), epoch + 1);
  EXPECT_TRUE(axis_->reference().lost());
  EXPECT_EQ(axis_->unexplained_jumps(), 1);
}

Scale Make(double per_turn, std::int64_t num, std::int64_t den, double modulo) {
  TestDevice device;
  device.config.per_turn = per_turn;
  device.config.ratio_num = num;
  device.config.ratio_den = den;
  device.config.modulo = modulo;
  return Scale(device.config);
}

TEST(Counts, NearestGoesTheShortWay) {
  EXPECT_EQ(Nearest(0, 360, 350), 360);
  EXPECT_EQ(Nearest(350, 360, 0), -10);
  EXPECT_EQ(Nearest(180, 360, 0), -180);  // half way round: [-180, 180)
  EXPECT_EQ(Nearest(5, 360, -725), -715);
  EXPECT_EQ(FloorMod(-1, 360), 359);
}

// The examples of docs/positions.md.
TEST(Scale, WorkedExamples) {
  const Scale screw = Make(5, 1, 1, 0);  // 5 mm per turn
  EXPECT_DOUBLE_EQ(screw.Value(10 * kTurn + kTurn / 2), 52.5);
  EXPECT_DOUBLE_EQ(screw.Value(-kTurn), -5);
  const Scale geared = Make(360, 1, 10, 360);  // a table behind a 10:1 gear, in degrees
  EXPECT_DOUBLE_EQ(geared.Value(10 * kTurn), 0);
  EXPECT_DOUBLE_EQ(geared.Value(25 * kTurn), 180);
  EXPECT_DOUBLE_EQ(geared.Value(-kTurn), 324);
}

TEST(Scale, AngleIsWithinOneTurn) {
  const Scale scale = Make(1, 1, 1, 0);
  EXPECT_DOUBLE_EQ(scale.AngleRad(0), 0);
  EXPECT_DOUBLE_EQ(scale.AngleRad(kTurn / 4), std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(scale.AngleRad(-kTurn / 4), 1.5 * std::numbers::pi);
  EXPECT_LT(scale.AngleRad(-1), 2 * std::numbers::pi);
}

TEST(Scale, ModuloIsExactHoweverFarTheAxisWent) {
  const Scale third = Make(360, 1, 3, 360);
  // 2^40 turns of a shaft behind 3:1 plus a quarter of the table's turn.
  const std::int64_t far = (INT64_C(1) << 40) / 3 * 3 * kTurn;
  EXPECT_DOUBLE_EQ(third.Value(far + 3 * kTurn / 4), 90);
  EXPECT_DOUBLE_EQ(third.Value(-far - 3 * kTurn / 4), 270);
  const Scale faster = Make(360, 7, 3, 360);
  EXPECT_NEAR(faster.Value(far + 1), 360.0 * 7 / 3 / kTurn, 1e-9);
}

TEST(Scale, ModuloThatIsNoWholeNumberOfCountsStillWraps) {
  const Scale odd = Make(1, 1, 1, std::numbers::pi);
  for (std::int64_t counts = -20 * kTurn; counts < 20 * kTurn; counts += 997) {
    const double value = odd.Value(counts);
    ASSERT_GE(value, 0);
    ASSERT_LT(value, std::numbers::pi);
  }
}

TEST(Scale, CountsOfAValue) {
  const Scale screw = Make(5, 1, 1, 0);
  EXPECT_EQ(screw.Counts(52.5), 10 * kTurn + kTurn / 2);
  EXPECT_EQ(screw.Counts(-5), -kTurn);
  EXPECT_EQ(screw.Counts(std::numeric_limits<double>::infinity()), std::nullopt);
  EXPECT_EQ(screw.Counts(1e15), std::nullopt);
}

TEST(Scale, TurnsMatterUnlessTheModuloDividesTheTurn) {
  EXPECT_TRUE(Make(5, 1, 1, 0).TurnsMatter());
  EXPECT_TRUE(Make(360, 1, 10, 360).TurnsMatter());
  EXPECT_FALSE(Make(360, 1, 1, 360).TurnsMatter());
  EXPECT_FALSE(Make(360, 3, 1, 120).TurnsMatter());
}

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
  Settle(kWhole - 2 * kTurn);  // the axis is two turns below its datum, which was set at turn 0
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
  Restore(0);  // homed before the restart, moved ten turns since: unknown
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

struct FlagCase {
  const char* name;
  void (*change)(Sample& sample);
  TurnsMode mode;
  std::int32_t flags;
};

class AxisFlags : public AxisTest, public testing::WithParamInterface<FlagCase> {};

TEST_P(AxisFlags, FollowFromTheSample) {
  device_.config.turns = GetParam().mode;
  Make();
  Settle(5 * kTurn);
  Sample sample = ReadingAt(t_, 5 * kTurn);
  GetParam().change(sample);
  EXPECT_EQ(Read(sample).flags, GetParam().flags);
}

INSTANTIATE_TEST_SUITE_P(
    Table, AxisFlags,
    testing::Values(
        FlagCase{"good", [](Sample&) {}, TurnsMode::kModulo, kUsable},
        FlagCase{"warning", [](Sample& s) { s.warning = true; }, TurnsMode::kModulo, kUsable | 0x80},
        FlagCase{"low_accuracy", [](Sample& s) { s.low_accuracy = true; }, TurnsMode::kModulo, kUsable | 0x20},
        FlagCase{"error", [](Sample& s) { s.error = true; }, TurnsMode::kModulo, 0x40},
        FlagCase{"error_and_warning", [](Sample& s) { s.error = s.warning = true; }, TurnsMode::kModulo, 0xC0},
        FlagCase{"wrapped_modulo", [](Sample& s) { s.turns_wrapped = true; }, TurnsMode::kModulo, kUsable | 0x04},
        FlagCase{"wrapped_signed", [](Sample& s) { s.turns_wrapped = true; }, TurnsMode::kSigned, kUsable | 0x04},
        FlagCase{"wrapped_unsigned", [](Sample& s) { s.turns_wrapped = true; }, TurnsMode::kUnsigned, 0x01 | 0x04},
        FlagCase{"no_turns", [](Sample& s) { s.has_turns = false; }, TurnsMode::kModulo, kUsable | 0x200},
        FlagCase{"doubted_turns", [](Sample& s) { s.turns_trusted = false; }, TurnsMode::kModulo, 0x01 | 0x200},
        FlagCase{"implausible", [](Sample& s) { s.turns = 9; }, TurnsMode::kModulo, 0x100},
        FlagCase{"implausible_error", [](Sample& s) { s.turns = 9, s.error = true; }, TurnsMode::kModulo, 0x40}),
    [](const testing::TestParamInfo<FlagCase>& tested) { return std::string(tested.param.name); });

TEST_F(AxisTest, SpeedIsUnknownThenRight) {
  Make();
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
  Settle(0);
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
  // 1,500 min-1 = 25 turns/s = 157.08 rad/s, read every ms.
  std::int64_t position = 0;
  for (int ms = 1; ms <= 40; ++ms) {
    position = kTurn * 25 * ms / 1'000;
    Read(position);
  }
  EXPECT_NEAR(axis_->SpeedRadS(), 50 * std::numbers::pi, 0.02);
  Sample low = ReadingAt(t_, position);
  low.low_accuracy = true;
  Read(low);
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
}

// As on a Modbus line: far apart, and the instant known to a fifth of that only.
TEST_F(AxisTest, SpeedFromReadingsWithUncertainInstants) {
  Make();
  constexpr MonoNs kApart = 25 * kMillisecond;
  for (int i = 0; i < 20; ++i) {
    t_ += kApart;
    // 120 min-1 = 2 turns/s
    (void)axis_->Take(ReadingAt(t_, kTurn * 2 * 25 * i / 1'000, 5 * kMillisecond));
  }
  EXPECT_NEAR(axis_->SpeedRadS(), 4 * std::numbers::pi, 0.02);
  // Timestamps with an uncertainty of half a second give no speed.
  t_ += kApart;
  (void)axis_->Take(ReadingAt(t_, kTurn, kSecond / 2));
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
}

TEST_F(AxisTest, SpeedAtTheFullRateOfTheWire) {
  Make();
  t_ = kSecond;
  // 19.6 kHz, 3,000 min-1, one count of noise: 50 turns/s = 314.159 rad/s.
  std::mt19937_64 random(6);
  for (int i = 0; i < 2'000; ++i) {
    const double turned = 50.0 * static_cast<double>(kTurn) * static_cast<double>(t_ - kSecond) * 1e-9;
    (void)axis_->Take(ReadingAt(t_, static_cast<std::int64_t>(turned) + static_cast<std::int64_t>(random() % 3)));
    t_ += 51 * kMicrosecond;
  }
  EXPECT_NEAR(axis_->SpeedRadS(), 100 * std::numbers::pi, 0.02);
}

// ---- scale and reference at their limits ----

TEST(Scale, AModuloThatIsNoWholeNumberOfCountsIsTheRestOfTheDivision) {
  const Scale odd = Make(0.7, 1, 1, 1);
  EXPECT_NEAR(odd.Value(10 * kTurn), 0, 1e-9);
  EXPECT_NEAR(odd.Value(11 * kTurn), 0.7, 1e-9);
  EXPECT_NEAR(odd.Value(-kTurn), 0.3, 1e-9);
  EXPECT_NEAR(odd.Value(3 * kTurn), 0.1, 1e-9);
}

TEST(Scale, AModuloOfOneIsAModulo) {
  const Scale turns = Make(1, 1, 1, 1);
  EXPECT_DOUBLE_EQ(turns.Value(5 * kTurn + kTurn / 4), 0.25);
  EXPECT_FALSE(turns.TurnsMatter());
}

TEST(Scale, TurnsMatterIfATurnIsAPartOfTheModulo) {
  EXPECT_TRUE(Make(0.5, 1, 1, 1).TurnsMatter());
  EXPECT_TRUE(Make(1, 1, 1, 1e10).TurnsMatter()) << "however small the part is";
}

TEST(Scale, CountsReachTo2To52) {
  const Scale counts = Make(kTurn, 1, 1, 0);
  EXPECT_EQ(counts.Counts(4503599627370496.0), INT64_C(1) << 52);
  EXPECT_EQ(counts.Counts(4503599627370497.0), std::nullopt);
}

TEST(Reference, AnInstantIsBetweenTwoOthersOr2SecondsLater) {
  EXPECT_TRUE(Reference::Within(100, 100, 200));
  EXPECT_FALSE(Reference::Within(99, 100, 200));
  EXPECT_TRUE(Reference::Within(200 + 2 * kSecond, 100, 200));
  EXPECT_FALSE(Reference::Within(201 + 2 * kSecond, 100, 200));
}

TEST(Reference, ToClearItWithoutADatumThatWasSetIsNoJump) {
  TestDevice device;
  Reference none(device.config);
  none.Clear();
  EXPECT_EQ(none.epoch(), 0);
  device.config.datum_counts = 500;
  Reference fixed(device.config);
  fixed.Clear();
  EXPECT_EQ(fixed.epoch(), 0);
  fixed.Set({600, 1}, 0, 0);
  fixed.Clear();
  EXPECT_EQ(fixed.epoch(), 2);
  EXPECT_EQ(fixed.datum(), 500);
}

TEST(Reference, ADatumAtTheSameCountsOfAnotherTimeIsAnotherDatum) {
  TestDevice device;
  Reference reference(device.config);
  reference.Set({600, 1}, 0, 0);
  reference.Set({600, 2}, 0, 0);
  EXPECT_EQ(reference.epoch(), 2);
  EXPECT_EQ(reference.datum_unix_us(), 2);
  reference.Set({700, 2}, 0, 0);
  EXPECT_EQ(reference.epoch(), 3);
}

TEST(Reference, ItIsLostSinceTheFirstOfSeveralLosses) {
  for (const MonoNs set_at : {99, 100}) {
    TestDevice device;
    Reference reference(device.config);
    reference.Lose(100);
    reference.Lose(200);
    reference.Set({600, 1}, set_at, 300);
    EXPECT_EQ(reference.lost(), set_at < 100) << set_at;
  }
}

// ---- what follows from a jump or a datum ----

TEST_F(AxisTest, TheDirectionIsAlsoTheSignOfTheSpeed) {
  device_.config.direction = -1;
  Make();
  for (int ms = 0; ms <= 40; ++ms) Read(10 * ms);
  EXPECT_NEAR(axis_->SpeedRadS(), -10'000 * 2 * std::numbers::pi / kTurn, 1e-6);
}

TEST_F(AxisTest, AValueWithAnotherDatumCountsFromThere) {
  device_.config.per_turn = 5;
  Make();
  EXPECT_EQ(axis_->ValueWith(0), std::nullopt);
  Settle(10 * kTurn);
  Home(2 * kTurn);
  EXPECT_DOUBLE_EQ(axis_->ValueWith(2 * kTurn).value_or(0), 40);
  EXPECT_DOUBLE_EQ(axis_->ValueWith(0).value_or(0), 50);
  EXPECT_DOUBLE_EQ(axis_->ValueWith(4 * kTurn).value_or(0), 30);
  const double value = axis_->ValueWith(2 * kTurn).value_or(0);
  EXPECT_EQ(axis_->DatumFor(value), 2 * kTurn) << "the datum that is set gives the value that is read";
  EXPECT_EQ(axis_->DatumFor(0), 10 * kTurn);
}

TEST_F(AxisTest, AReadingThatTheDeviceDoubtsHasItsFlag) {
  Make();
  Settle(1'000);
  Sample sample = ReadingAt(t_, 1'000);
  sample.error = true;
  const AxisReading reading = Read(sample);
  EXPECT_EQ(reading.kind, Kind::kDoubtful);
  EXPECT_TRUE(Has(reading, position_t::FLAG_DEVICE_ERROR));
  EXPECT_FALSE(Has(reading, position_t::FLAG_TURNS_VALID));
  EXPECT_EQ(axis_->Counts(), std::nullopt);
}

TEST_F(AxisTest, AfterAnAnnouncedJumpTheSpeedIsUnknown) {
  Make();
  for (int ms = 0; ms <= 40; ++ms) Read(10 * ms);
  EXPECT_FALSE(std::isnan(axis_->SpeedRadS()));
  axis_->OnJump();
  EXPECT_TRUE(std::isnan(axis_->SpeedRadS()));
  EXPECT_EQ(axis_->Counts(), std::nullopt);
  EXPECT_EQ(axis_->LastValid(), std::nullopt);
}

TEST_F(AxisTest, OneImplausibleReadingLeavesThePositionUnknownUntilTheNext) {
  Make();
  Settle(1'000);
  EXPECT_EQ(Read(1'000 + 300 * kTurn).kind, Kind::kDoubtful);
  EXPECT_EQ(axis_->Counts(), std::nullopt);
  EXPECT_EQ(Read(1'001).kind, Kind::kGood);
  EXPECT_EQ(axis_->Counts(), 1'001);
  EXPECT_EQ(axis_->unexplained_jumps(), 0);
}

TEST_F(AxisTest, AJumpOfATableWithoutTurnsLosesTheTurnsOnly) {
  device_.settings->turns_range = 0;
  device_.config.per_turn = 360;
  device_.config.modulo = 360;
  Make();
  Read(SingleTurn(1'000));
  Read(SingleTurn(1'000));
  Home(0);
  t_ += kSecond;  // long enough for half a turn
  const AxisReading reading = Read(SingleTurn(2'000));
  EXPECT_EQ(reading.kind, Kind::kGood);
  EXPECT_FALSE(Has(reading, position_t::FLAG_TURNS_VALID));
  EXPECT_TRUE(Has(reading, position_t::FLAG_REFERENCED)) << "one turn is the whole modulo";
  EXPECT_FALSE(axis_->reference().lost());
}

// ---- exact values ----

TEST(Scale, AModuloOfOneCountAndOneOf2To52AreExact) {
  EXPECT_EQ(Make(0.3, 1, 1, 0.3 / kTurn).Value(3), 0) << "floating point would give the whole modulo";
  EXPECT_EQ(Make(0.3, 1, 1, 0.3 * static_cast<double>(INT64_C(1) << 35)).Value(3 * (INT64_C(1) << 52)), 0);
}

TEST(Scale, AGearThatIsTooLargeForAnExactModuloStillWraps) {
  constexpr double kModulo = static_cast<double>(INT64_C(1) << 35);
  const Scale scale = Make(1, 1 << 20, 1, kModulo);
  EXPECT_NEAR(scale.Value(kTurn * (INT64_C(1) << 14)), kModulo / 2, 1e-3);
  EXPECT_NEAR(scale.Value(kTurn * (INT64_C(1) << 14) * 3), kModulo / 2, 1e-3);
}

TEST(Scale, AnExactModuloThatAProductWouldOverflowIsTheRestOfTheDivision) {
  constexpr double kModulo = 3.0 * static_cast<double>(INT64_C(1) << 33);
  const Scale scale = Make(1, 1 << 20, 1, kModulo);
  EXPECT_DOUBLE_EQ(scale.Value((INT64_C(1) << 50) + (INT64_C(1) << 29)), kModulo / 2);
}

// A third of 2^55 counts: the nearest double is a whole number, the modulo is not.
TEST(Scale, AModuloBeyond2To52CountsIsNotRoundedToAWholeNumber) {
  EXPECT_EQ(Make(3, 1, 1, static_cast<double>(INT64_C(1) << 38)).Value(INT64_C(1) << 55), 0);
}

TEST(Scale, AModuloOfLessThanACountStillWraps) {
  const Scale scale = Make(kTurn, 1, 1, 0.75);
  EXPECT_DOUBLE_EQ(scale.Value(1), 0.25);
  EXPECT_DOUBLE_EQ(scale.Value(-1), 0.5);
}

TEST(Scale, AValueIsBelowItsModuloAlsoWhereARoundingWouldReachIt) {
  EXPECT_EQ(Make(1, 1, 1, std::numbers::pi * 1e12).Value(-1), 0);
}

}  // namespace
}  // namespace axlecast
