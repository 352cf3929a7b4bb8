#include <gtest/gtest.h>
#include <cmath>

#include "drivers/tformat/encoder_model.h"

namespace axlecast::tformat {

namespace {

constexpr MonoNs kApart = 40 * kMillisecond;

// True when the last of `times` requests, each `apart`, completes.
bool Repeat(ResetCounter& counter, std::uint8_t id, int times, MonoNs apart, MonoNs& now) {
  bool complete = false;
  for (int i = 0; i < times; ++i) {
    now += apart;
    complete = counter.OnReset(id, now);
  }
  return complete;
}

TEST(ResetCounterTest, TenRequestsFortyMillisecondsApart) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0x7, 9, kApart, now));
  EXPECT_TRUE(Repeat(counter, 0x7, 1, kApart, now));
  EXPECT_EQ(counter.broken(), 0);
}

TEST(ResetCounterTest, AfterTheTenthTheCountBeginsAnew) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_TRUE(Repeat(counter, 0x7, 10, kApart, now));
  EXPECT_FALSE(Repeat(counter, 0x7, 9, kApart, now));
  EXPECT_TRUE(Repeat(counter, 0x7, 1, kApart, now));
}

TEST(ResetCounterTest, ThirtyNineMillisecondsDoNotCount) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0xC, 100, 39 * kMillisecond, now));
  EXPECT_GT(counter.too_early(), 0);
  EXPECT_LE(counter.count(), 1);
}

TEST(ResetCounterTest, OneEarlyRequestEndsTheSequence) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0x7, 8, kApart, now));
  EXPECT_FALSE(Repeat(counter, 0x7, 1, kApart - 1, now));
  EXPECT_EQ(counter.count(), 0);
  EXPECT_FALSE(Repeat(counter, 0x7, 9, kApart, now));
  EXPECT_TRUE(Repeat(counter, 0x7, 1, kApart, now));
}

TEST(ResetCounterTest, AnotherResetEndsTheSequence) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0x7, 9, kApart, now));
  EXPECT_FALSE(Repeat(counter, 0xC, 1, kApart, now));
  EXPECT_FALSE(Repeat(counter, 0x7, 1, kApart, now));
  EXPECT_EQ(counter.broken(), 2);
}

TEST(ResetCounterTest, AReadoutEndsTheSequence) {
  ResetCounter counter;
  MonoNs now = kSecond;
  EXPECT_FALSE(Repeat(counter, 0x8, 9, kApart, now));
  counter.Break();
  EXPECT_FALSE(Repeat(counter, 0x8, 9, kApart, now));
  EXPECT_TRUE(Repeat(counter, 0x8, 1, kApart, now));
  EXPECT_EQ(counter.broken(), 1);
}

constexpr MonoNs kStart = 1'000 * kSecond;
constexpr std::uint8_t kClearErrors = 0x7;  // TS5669 spec 9
constexpr std::uint8_t kZero = 0x8;
constexpr std::uint8_t kResetTurns = 0xC;

class EncoderModelTest : public testing::Test {
 protected:
  // At rest at 90 deg in turn 7.
  EncoderModelTest() : encoder_(EncoderModel::Settings(), 7 * kShaftTurn + kShaftTurn / 4) {
    encoder_.Advance(now_);
  }

  void Pass(MonoNs time) { encoder_.Advance(now_ += time); }
  EncoderModel::Reading Read() { return encoder_.Read(now_); }

  void ShaftToTurn(double rpm) { encoder_.ShaftToTurn(now_).Run(rpm, encoder_.now()); }
  void TurnWithin(double rpm, MonoNs time) {
    const double change = std::abs(rpm - encoder_.shaft().At(now_).speed_rpm) / 60 * 2 * 3.15;  // rad/s, and a bit
    encoder_.ShaftToTurn(now_).SetAcceleration(change / (static_cast<double>(time) * 1e-9));
    ShaftToTurn(rpm);
    Pass(time);
  }

  void Reset(std::uint8_t id, int times = 10, MonoNs apart = 40 * kMillisecond) {
    for (int i = 0; i < times; ++i) {
      Pass(apart);
      encoder_.OnReset(id, now_);
    }
  }

  void PowerCycle(MonoNs off) {
    encoder_.SetPower(false, now_);
    Pass(off);
    encoder_.SetPower(true, now_);
    Pass(2 * kSecond);
  }

  MonoNs now_ = kStart;
  EncoderModel encoder_;
};

TEST_F(EncoderModelTest, ReadsAngleAndTurns) {
  EXPECT_EQ(Read().single_turn, 131'072U / 4);  // 2^17 a turn, spec 5.4.1
  EXPECT_EQ(Read().multi_turn, 7U);
  EXPECT_EQ(Read().encoder_id, 0x11);  // spec 6.3.3
}

TEST_F(EncoderModelTest, CounterClockwiseIncreasesBoth) {
  encoder_.ShaftToTurn(now_).MoveTo(8 * kShaftTurn + kShaftTurn / 2, 60, now_);
  Pass(10 * kSecond);
  EXPECT_EQ(Read().single_turn, 131'072U / 2);
  EXPECT_EQ(Read().multi_turn, 8U);
}

// ---- battery, spec 5.4 and 6.4 ----

TEST_F(EncoderModelTest, BatteryAlarmAt3_1VoltsClearsItself) {
  encoder_.SetBattery(3.11, now_);
  EXPECT_FALSE(Read().battery_alarm);
  encoder_.SetBattery(3.1, now_);
  EXPECT_TRUE(Read().battery_alarm);
  EXPECT_FALSE(Read().battery_error);
  encoder_.SetBattery(3.6, now_);
  EXPECT_FALSE(Read().battery_alarm);
}

TEST_F(EncoderModelTest, BatteryErrorAt2_5VoltsIsLatched) {
  encoder_.SetBattery(2.51, now_);
  EXPECT_FALSE(Read().battery_error);
  encoder_.SetBattery(2.5, now_);
  EXPECT_TRUE(Read().battery_error);
  encoder_.SetBattery(3.6, now_);
  EXPECT_TRUE(Read().battery_error);
  EXPECT_FALSE(Read().battery_alarm);
  Reset(kClearErrors);
  EXPECT_FALSE(Read().battery_error);
  EXPECT_EQ(Read().multi_turn, 7U) << "clearing errors keeps the turns";
}

TEST_F(EncoderModelTest, BatteryErrorComesBackWhileTheBatteryIsEmpty) {
  encoder_.SetBattery(2.0, now_);
  Reset(kClearErrors);
  EXPECT_EQ(encoder_.effects().error_clears, 1);
  EXPECT_TRUE(Read().battery_error);
}

TEST_F(EncoderModelTest, TurnsAreCountedWithoutMainPower) {
  encoder_.SetPower(false, now_);
  encoder_.ShaftToTurn(now_).MoveTo(20 * kShaftTurn + kShaftTurn / 8, 600, now_);
  Pass(100 * kSecond);
  encoder_.SetPower(true, now_);
  Pass(kSecond);
  EXPECT_EQ(Read().multi_turn, 20U);
  EXPECT_FALSE(Read().over_speed || Read().battery_error || Read().counter_overflow);
}

TEST_F(EncoderModelTest, WithoutBatteryTheTurnsAreLost) {
  encoder_.SetBattery(0, now_);
  PowerCycle(kSecond);
  EXPECT_EQ(Read().multi_turn, 0U);
  EXPECT_EQ(Read().single_turn, 131'072U / 4) << "the single-turn position needs no battery";
  EXPECT_TRUE(Read().battery_error);
  EXPECT_TRUE(Read().battery_alarm);
}

TEST_F(EncoderModelTest, ABatteryThatDiesDuringPowerOffShowsAfterIt) {
  encoder_.SetPower(false, now_);
  Pass(kSecond);
  encoder_.SetBattery(2.4, now_);
  encoder_.SetBattery(3.6, now_);  // replaced before the power comes back
  encoder_.SetPower(true, now_);
  Pass(kSecond);
  EXPECT_TRUE(Read().battery_error);
  EXPECT_FALSE(Read().battery_alarm);
  EXPECT_NE(Read().multi_turn, 7U);
}

// ---- power-on, spec 5.4 ----

TEST_F(EncoderModelTest, StandbyIsOneSecondWithBattery) {
  encoder_.SetPower(false, now_);
  EXPECT_FALSE(encoder_.Accepts(now_));
  encoder_.SetPower(true, now_);
  EXPECT_FALSE(encoder_.Accepts(now_ + 999 * kMillisecond));
  EXPECT_TRUE(encoder_.Accepts(now_ + kSecond));
}

TEST_F(EncoderModelTest, StandbyIsOneAndAHalfSecondsWithoutBattery) {
  encoder_.SetBattery(0, now_);
  encoder_.SetPower(false, now_);
  encoder_.SetPower(true, now_);
  EXPECT_FALSE(encoder_.Accepts(now_ + 1'499 * kMillisecond));
  EXPECT_TRUE(encoder_.Accepts(now_ + 1'500 * kMillisecond));
}

// Spec 5.4.1, note 3.
TEST_F(EncoderModelTest, PoweredOnWhileTurningTheAccuracyIsFiveBitsUntilBelow100Rpm) {
  TurnWithin(100, kSecond);
  PowerCycle(kSecond);
  EXPECT_TRUE(Read().full_absolute);
  EXPECT_EQ(Read().single_turn % (131'072U / 32), 0U);
  ShaftToTurn(99);
  Pass(kSecond);
  EXPECT_FALSE(Read().full_absolute);
  EXPECT_NE(Read().single_turn % (131'072U / 32), 0U);
  ShaftToTurn(200);
  Pass(kSecond);
  EXPECT_FALSE(Read().full_absolute) << "only power-on while turning raises it";
}

TEST_F(EncoderModelTest, PoweredOnBelow100RpmTheAccuracyIsFull) {
  TurnWithin(99, kSecond);
  PowerCycle(kSecond);
  EXPECT_FALSE(Read().full_absolute);
}

// ---- over-speed, spec 5.4.2 ----

TEST_F(EncoderModelTest, OverSpeedIsLatchedOnlyDuringPowerOff) {
  TurnWithin(6'500, kSecond);
  TurnWithin(0, kSecond);
  EXPECT_FALSE(Read().over_speed);
  encoder_.SetPower(false, now_);
  TurnWithin(6'500, kSecond);
  TurnWithin(0, kSecond);
  encoder_.SetPower(true, now_);
  Pass(kSecond);
  EXPECT_TRUE(Read().over_speed);
  PowerCycle(kSecond);
  EXPECT_TRUE(Read().over_speed) << "latched";
  Reset(kClearErrors);
  EXPECT_FALSE(Read().over_speed);
}

TEST_F(EncoderModelTest, AtOverSpeedTurnsAreMiscounted) {
  const std::int64_t before = Read().multi_turn;
  encoder_.SetPower(false, now_);
  encoder_.ShaftToTurn(now_).SetAcceleration(2'000);
  encoder_.ShaftToTurn(now_).MoveTo(1'000 * kShaftTurn + kShaftTurn / 2, 7'000, now_);
  Pass(60 * kSecond);
  encoder_.SetPower(true, now_);
  Pass(kSecond);
  EXPECT_EQ(before, 7);
  EXPECT_EQ(Read().multi_turn, 999U);
}

TEST_F(EncoderModelTest, SixThousandRpmIsNoOverSpeed) {
  encoder_.SetPower(false, now_);
  TurnWithin(6'000, 10 * kSecond);
  TurnWithin(0, 10 * kSecond);
  encoder_.SetPower(true, now_);
  EXPECT_FALSE(Read().over_speed);
}

// 80,000 rad/s^2 for 5 s after power-off, then 4,000.
TEST_F(EncoderModelTest, HardAccelerationCountsAfterThePowerOffTimer) {
  encoder_.SetPower(false, now_);
  encoder_.ShaftToTurn(now_).SetAcceleration(10'000);
  ShaftToTurn(1'000);
  Pass(kSecond);
  ShaftToTurn(0);
  Pass(3 * kSecond);
  encoder_.SetPower(true, now_);
  EXPECT_FALSE(Read().over_speed);
  encoder_.SetPower(false, now_);
  Pass(5 * kSecond);
  ShaftToTurn(1'000);
  Pass(kSecond);
  encoder_.SetPower(true, now_);
  EXPECT_TRUE(Read().over_speed);
}

// ---- counter overflow, spec 6.4 ----

TEST_F(EncoderModelTest, OverflowFrom65535To0IsLatched) {
  encoder_.ShaftToTurn(now_).SetAcceleration(80'000);
  encoder_.ShaftToTurn(now_).MoveTo(65'535 * kShaftTurn + kShaftTurn / 2, 6'000, now_);
  Pass(660 * kSecond);
  EXPECT_EQ(Read().multi_turn, 65'535U);
  EXPECT_FALSE(Read().counter_overflow);
  encoder_.ShaftToTurn(now_).MoveTo(65'536 * kShaftTurn, 60, now_);
  Pass(2 * kSecond);
  EXPECT_EQ(Read().multi_turn, 0U);
  EXPECT_TRUE(Read().counter_overflow);
  PowerCycle(kSecond);
  EXPECT_TRUE(Read().counter_overflow) << "held in spite of main power on/off";
  encoder_.ShaftToTurn(now_).MoveTo(65'535 * kShaftTurn, 60, now_);
  Pass(2 * kSecond);
  EXPECT_EQ(Read().multi_turn, 65'535U);
  EXPECT_TRUE(Read().counter_overflow) << "held in spite of the counting value";
}

TEST_F(EncoderModelTest, AnOverflowThatComesBackBetweenTwoLooksIsSeen) {
  encoder_.ShaftToTurn(now_).Shuttle(-kShaftTurn / 2, kShaftTurn / 2, 600, now_);
  Pass(60 * kSecond);
  EXPECT_TRUE(Read().counter_overflow);
}

TEST_F(EncoderModelTest, AShuttleFromTurnZeroAndBackIsNoOverflow) {
  encoder_.ShaftToTurn(now_).Shuttle(0, 10 * kShaftTurn, 300, now_);
  Pass(600 * kSecond);
  EXPECT_FALSE(Read().counter_overflow);
}

TEST_F(EncoderModelTest, AStartBeyondTheFirstRangeIsNoOverflow) {
  EncoderModel encoder(EncoderModel::Settings(), -5 * kShaftTurn);
  EXPECT_FALSE(encoder.Read(kStart).counter_overflow);
  EXPECT_EQ(encoder.Read(kStart).multi_turn, 65'531U);
}

// Spec 5.4.2, note 4.
TEST_F(EncoderModelTest, AfterABatteryErrorOverflowNeedsATurnReset) {
  encoder_.SetBattery(2.4, now_);
  encoder_.SetBattery(3.6, now_);
  Reset(kClearErrors);
  encoder_.ShaftToTurn(now_).MoveTo(-kShaftTurn, 600, now_);
  Pass(10 * kSecond);
  EXPECT_FALSE(Read().counter_overflow);
  Reset(kResetTurns);
  encoder_.ShaftToTurn(now_).MoveTo(-3 * kShaftTurn, 600, now_);
  Pass(10 * kSecond);
  EXPECT_TRUE(Read().counter_overflow);
}

// ---- counting and multi-turn errors ----

TEST_F(EncoderModelTest, ACountingErrorDeviatesWhileItLasts) {
  encoder_.SetCountingError(EncoderModel::CountingError::kLive, now_);
  EXPECT_TRUE(Read().counting_error);
  const double deviation_deg = (static_cast<double>(Read().single_turn) - 131'072.0 / 4) / 131'072 * 360;
  EXPECT_GT(std::abs(deviation_deg), 22.5);
  Reset(kClearErrors);
  EXPECT_TRUE(Read().counting_error) << "case I clears itself, and only itself";
  encoder_.SetCountingError(EncoderModel::CountingError::kNone, now_);
  EXPECT_EQ(Read().single_turn, 131'072U / 4);
}

TEST_F(EncoderModelTest, CountingErrorIIIsLatched) {
  encoder_.SetCountingError(EncoderModel::CountingError::kLatched, now_);
  Reset(kResetTurns);
  EXPECT_FALSE(Read().counting_error);
  encoder_.SetCountingError(EncoderModel::CountingError::kLatched, now_);
  PowerCycle(kSecond);
  EXPECT_FALSE(Read().counting_error);
}

TEST_F(EncoderModelTest, ABitJumpIsAMultiTurnError) {
  encoder_.JumpTurns(8, now_);
  EXPECT_TRUE(Read().multi_turn_error);
  EXPECT_EQ(Read().multi_turn, 15U);
  Reset(kClearErrors);
  EXPECT_FALSE(Read().multi_turn_error);
  EXPECT_EQ(Read().multi_turn, 15U);
  EXPECT_FALSE(Read().counter_overflow);
}

// ---- resets, spec 9 ----

TEST_F(EncoderModelTest, TurnResetSetsTurnsToZeroAndClearsErrors) {
  encoder_.JumpTurns(1, now_);
  Reset(kResetTurns, 9);
  EXPECT_EQ(Read().multi_turn, 8U);
  Reset(kResetTurns, 1);
  EXPECT_EQ(Read().multi_turn, 0U);
  EXPECT_EQ(Read().single_turn, 131'072U / 4) << "one revolution data is not reset";
  EXPECT_FALSE(Read().multi_turn_error);
  EXPECT_EQ(encoder_.effects().turn_resets, 1);
  EXPECT_EQ(encoder_.effects().error_clears, 0);
}

TEST_F(EncoderModelTest, ZeroIsExecutedWithin18MillisecondsAndWithinAThirdOfADegree) {
  Reset(kZero);
  Pass(17 * kMillisecond);
  EXPECT_EQ(encoder_.effects().zeroings, 0);
  EXPECT_EQ(Read().single_turn, 131'072U / 4);
  Pass(kMillisecond);
  EXPECT_EQ(encoder_.effects().zeroings, 1);
  EXPECT_LE(Read().single_turn, 127U);  // 0.35 deg is 127 counts
  EXPECT_EQ(Read().multi_turn, 7U) << "the turns are not reset";
  EXPECT_EQ(encoder_.eeprom().wear(), 1);
  PowerCycle(kSecond);
  EXPECT_LE(Read().single_turn, 127U) << "kept after power-off";
}

TEST_F(EncoderModelTest, AZeroBelowZeroKeepsTheTurnsToo) {
  encoder_.settings().zero_error_deg = -0.35;
  Reset(kZero);
  Pass(18 * kMillisecond);
  EXPECT_GE(Read().single_turn, 131'072U - 128);
  EXPECT_EQ(Read().multi_turn, 7U);
}

TEST_F(EncoderModelTest, ThirtyNineMillisecondsApartNothingIsReset) {
  Reset(kResetTurns, 100, 39 * kMillisecond);
  EXPECT_EQ(encoder_.effects().turn_resets, 0);
  EXPECT_EQ(Read().multi_turn, 7U);
}

TEST_F(EncoderModelTest, AReadoutInBetweenBreaksTheSequence) {
  Reset(kResetTurns, 9);
  encoder_.OnOtherRequest();
  Reset(kResetTurns, 9);
  EXPECT_EQ(encoder_.effects().turn_resets, 0);
  Reset(kResetTurns, 1);
  EXPECT_EQ(encoder_.effects().turn_resets, 1);
}

TEST_F(EncoderModelTest, AMovingShaftIsNotZeroed) {
  ShaftToTurn(0.01);
  Reset(kZero, 20);
  Pass(kSecond);
  EXPECT_EQ(encoder_.effects().zeroings, 0);
  EXPECT_EQ(encoder_.effects().refused_zeroings, 20);
  EXPECT_EQ(encoder_.eeprom().wear(), 0);
}

TEST_F(EncoderModelTest, AMoveBetweenTwoRequestsIsNoStandstill) {
  Reset(kZero, 5);
  encoder_.ShaftToTurn(now_).MoveTo(7 * kShaftTurn, 600, now_);
  Pass(10 * kSecond);  // it is at rest again
  Reset(kZero, 5);
  Pass(kSecond);
  EXPECT_EQ(encoder_.effects().zeroings, 0);
  EXPECT_EQ(encoder_.effects().refused_zeroings, 1);
}

TEST_F(EncoderModelTest, ErrorsAndTurnsAreResetWhileTurning) {
  encoder_.JumpTurns(1, now_);
  TurnWithin(60, kSecond);
  Reset(kClearErrors);
  EXPECT_FALSE(Read().multi_turn_error);
}

TEST_F(EncoderModelTest, PowerOffEndsASequenceAndAZeroUnderWay) {
  Reset(kZero);
  Pass(kMillisecond);
  PowerCycle(kSecond);
  EXPECT_EQ(encoder_.effects().zeroings, 0);
  EXPECT_EQ(Read().single_turn, 131'072U / 4);
  Reset(kResetTurns, 5);
  PowerCycle(kSecond);
  Reset(kResetTurns, 5);
  EXPECT_EQ(encoder_.effects().turn_resets, 0);
}

// ---- EEPROM, spec 6.1.1 and 8.1 ----

TEST_F(EncoderModelTest, AWriteIsCompleteAfter18Milliseconds) {
  EncoderEeprom& eeprom = encoder_.eeprom();
  EXPECT_EQ(eeprom.Read(79), 0) << "all data is 0 at shipping";
  eeprom.Write(79, 0xA5, now_);
  Pass(18 * kMillisecond - 1);
  EXPECT_TRUE(eeprom.Busy(now_));
  EXPECT_EQ(eeprom.writes_done(), 0);
  Pass(1);
  EXPECT_FALSE(eeprom.Busy(now_));
  EXPECT_EQ(eeprom.Read(79), 0xA5);
  EXPECT_EQ(eeprom.writes_done(), 1);
}

TEST_F(EncoderModelTest, PowerOffLosesAWriteUnderWay) {
  encoder_.eeprom().Write(3, 1, now_);
  Pass(kMillisecond);
  PowerCycle(kSecond);
  EXPECT_EQ(encoder_.eeprom().Read(3), 0);
  EXPECT_EQ(encoder_.eeprom().writes_lost(), 1);
}

TEST_F(EncoderModelTest, After100000WritesTheMemoryKeepsItsContent) {
  encoder_.eeprom().SetWear(99'999);
  encoder_.eeprom().Write(0, 1, now_);
  Pass(kSecond);
  encoder_.eeprom().Write(0, 2, now_);
  Pass(kSecond);
  EXPECT_EQ(encoder_.eeprom().Read(0), 1);
  EXPECT_EQ(encoder_.eeprom().wear(), 100'000);
  Reset(kZero);
  Pass(kSecond);
  EXPECT_EQ(encoder_.effects().zeroings, 0);
}

// ---- others ----

TEST_F(EncoderModelTest, StuckTheReadingStandsAndTheShaftTurns) {
  encoder_.SetStuck(true, now_);
  ShaftToTurn(60);
  Pass(10 * kSecond);
  EXPECT_EQ(Read().single_turn, 131'072U / 4);
  EXPECT_EQ(Read().multi_turn, 7U);
  encoder_.SetStuck(false, now_);
  EXPECT_GT(Read().multi_turn, 15U);
}

TEST_F(EncoderModelTest, NoiseStaysWithinItsBound) {
  encoder_.settings().noise_counts = 4;
  bool varied = false;
  for (int i = 0; i < 1'000; ++i) {
    const std::int64_t deviation = std::int64_t{Read().single_turn} - 131'072 / 4;
    ASSERT_LE(std::abs(deviation), 4);
    varied = varied || deviation != 0;
  }
  EXPECT_TRUE(varied);
}

TEST(EncoderModelSizesTest, OtherModels) {
  EncoderModel::Settings settings;
  settings.single_turn_bits = 23;
  settings.encoder_id = 0x17;
  EncoderModel fine(settings, 3 * kShaftTurn + kShaftTurn / 2);
  EXPECT_EQ(fine.Read(0).single_turn, 1U << 22U);
  EXPECT_EQ(fine.Read(0).multi_turn, 3U);
  settings.multi_turn_bits = 0;
  EncoderModel single(settings, 0);
  single.ShaftToTurn(0).Run(600, 0);
  EXPECT_EQ(single.Read(10 * kSecond).multi_turn, 0U);
  EXPECT_FALSE(single.Read(10 * kSecond).counter_overflow);
}

}  // namespace

}  // namespace axlecast::tformat
