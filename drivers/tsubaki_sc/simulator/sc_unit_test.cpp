#include "drivers/tsubaki_sc/simulator/sc_unit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

// Motor, trips and logs of a simulated unit against the communication guideline, sections 10 and 11.
namespace axlecast::tsubaki_sc::simulator {
namespace {

constexpr MonoNs kStart = 77 * kSecond + 123;
constexpr MonoNs kTick = 100 * kMillisecond;

class ScUnitTest : public testing::Test {
 protected:
  ScUnitTest() {
    unit_.motor.SetLoad(200);
    unit_.motor.settings.run_up_w = 0;
    unit_.Advance(kStart);
    // Set 1; one limit at a time, each of 50 Hz.
    for (const int address : {0, 1, 2, 3, 4, 5, 6, 7, 52, 53}) Preset(static_cast<std::uint16_t>(address), 0);
    Preset(8, 20);   // start time 2 s
    Preset(54, 10);  // a sample each second
  }
  void Preset(std::uint16_t address, std::uint16_t value) { unit_.PresetParameter(address, value); }
  void Pass(MonoNs time) { unit_.Advance(unit_.now() + time); }
  // Returns how long the motor runs; a minute if it does not stop.
  MonoNs UntilTrip() {
    const MonoNs from = unit_.now();
    while (unit_.motor.running() && unit_.now() - from < 60 * kSecond) Pass(kMillisecond);
    return unit_.now() - from;
  }
  // Seven quantities x 20 samples of one log, as input registers.
  unsigned Log(unsigned log, unsigned quantity, unsigned sample) {
    return unit_.InputRegister(static_cast<std::uint16_t>(1000 * log + 100 * quantity + sample));
  }
  unsigned Status() { return unit_.InputRegister(201); }

  ScUnit unit_{1};
};

TEST_F(ScUnitTest, InstantaneousDataInTheirUnits) {
  unit_.motor.settings.voltage_v = 200.5;
  unit_.motor.settings.power_factor = 0.8;
  unit_.motor.settings.accel_mps2 = {1.25, -2.5, 0};
  unit_.motor.SetTemperature(-3.2);
  EXPECT_EQ(unit_.InputRegister(100), 2005);                            // 0.1 V
  EXPECT_EQ(unit_.InputRegister(101), 720);                             // mA: 200 / (sqrt 3 x 200.5 x 0.8)
  EXPECT_EQ(unit_.InputRegister(102), 2000);                            // 0.1 W
  EXPECT_EQ(static_cast<std::int16_t>(unit_.InputRegister(103)), -32);  // 0.1 C
  EXPECT_EQ(unit_.InputRegister(104), 125);                             // 0.01 m/s^2
  EXPECT_EQ(static_cast<std::int16_t>(unit_.InputRegister(105)), -250);
  unit_.motor.Stop();
  EXPECT_EQ(unit_.InputRegister(101), 0);
  EXPECT_EQ(unit_.InputRegister(102), 0);
}

struct PowerTrip {
  const char* name;
  std::uint16_t limit_address;  // of set 1, 50 Hz
  std::uint16_t limit;
  std::uint16_t shock_address;
  double load_w;
  unsigned bit;
};

class PowerTripTest : public ScUnitTest, public testing::WithParamInterface<PowerTrip> {};

// Beyond its limit for its shock time.
TEST_P(PowerTripTest, AfterItsShockTime) {
  const PowerTrip& trip = GetParam();
  Preset(trip.limit_address, trip.limit);
  Preset(trip.shock_address, 15);
  Pass(30 * kSecond);
  ASSERT_EQ(Status(), 0U);
  unit_.motor.SetLoad(trip.load_w);
  Pass(kSecond);
  unit_.motor.SetLoad(200);  // within the shock time: forgotten
  Pass(kSecond);
  unit_.motor.SetLoad(trip.load_w);
  EXPECT_NEAR(static_cast<double>(UntilTrip()), 15.0 * kTick, 2.0 * GearMotor::kStep);
  EXPECT_EQ(Status(), trip.bit);
  EXPECT_EQ(unit_.InputRegister(202), trip.bit);
  EXPECT_EQ(unit_.InputRegister(200), 1);
  EXPECT_EQ(unit_.InputRegister(102), 0) << "stopped";
  EXPECT_EQ(Log(1, 2, 19), 10 * trip.load_w);
  EXPECT_EQ(Log(1, 2, 18), 10 * trip.load_w) << "1 s before: within the shock time";
  EXPECT_EQ(Log(1, 2, 17), 2000U) << "2 s before";
  EXPECT_EQ(Log(1, 2, 16), 10 * trip.load_w) << "the first attempt";
  for (unsigned i = 0; i <= 15; ++i) EXPECT_EQ(Log(1, 2, i), 2000U) << i;
}

TEST_P(PowerTripTest, NotWithLimit0) {
  unit_.motor.SetLoad(GetParam().load_w);
  EXPECT_EQ(UntilTrip(), 60 * kSecond);
}

TEST_P(PowerTripTest, NotDuringTheStartTime) {
  unit_.motor.SetLoad(GetParam().load_w);
  unit_.SetPower(false);
  Preset(GetParam().limit_address, GetParam().limit);
  Preset(GetParam().shock_address, 0);
  unit_.SetPower(true);
  EXPECT_NEAR(static_cast<double>(UntilTrip()), 2.0 * kSecond, 2.0 * GearMotor::kStep);
  EXPECT_EQ(Status(), GetParam().bit);
}

TEST_P(PowerTripTest, OtherSetAndOtherMainsHaveTheirOwn) {
  Preset(GetParam().limit_address, GetParam().limit);
  Preset(GetParam().shock_address, 0);
  unit_.settings.mains_60_hz = true;
  unit_.motor.SetLoad(GetParam().load_w);
  EXPECT_EQ(UntilTrip(), 60 * kSecond);
  unit_.settings.mains_60_hz = false;
  EXPECT_LE(UntilTrip(), 2 * GearMotor::kStep);
}

INSTANTIATE_TEST_SUITE_P(Causes, PowerTripTest,
                         testing::Values(PowerTrip{"upper_a", 0, 4000, 9, 401, 0x01},
                                         PowerTrip{"upper_b", 2, 6000, 10, 601, 0x02},
                                         PowerTrip{"lower_a", 4, 500, 11, 49, 0x04},
                                         PowerTrip{"lower_b", 6, 300, 12, 29, 0x08}),
                         [](const auto& trip) { return trip.param.name; });

TEST_F(ScUnitTest, AtItsLimitNothingTrips) {
  Preset(0, 2000);
  Preset(4, 2000);
  Preset(9, 0);
  Preset(11, 0);
  Preset(52, 400);
  Preset(53, 1000);
  unit_.motor.settings.accel_mps2 = {10, -10, 10};
  EXPECT_EQ(UntilTrip(), 60 * kSecond);
}

// Guideline 11, note 1.
TEST_F(ScUnitTest, OverheatAndShockWithLimit0TripNothing) {
  unit_.motor.SetTemperature(130);
  unit_.motor.settings.accel_mps2 = {200, -200, 0};
  EXPECT_EQ(UntilTrip(), 60 * kSecond);
}

TEST_F(ScUnitTest, Overheat) {
  Preset(52, 900);
  unit_.motor.settings.ambient_c = 25;
  unit_.motor.settings.heating_c_per_w = 0.5;  // 125 C in the end
  unit_.motor.settings.thermal_s = 10;
  const MonoNs time = UntilTrip();
  // 125 - 85 exp(-t/10) = 90
  EXPECT_NEAR(static_cast<double>(time) * 1e-9, 8.87, 0.05);
  EXPECT_EQ(Status(), 0x20U);
  EXPECT_EQ(Log(1, 3, 19), 901U);
  for (unsigned i = 13; i <= 19; ++i) EXPECT_GT(Log(1, 3, i), Log(1, 3, i - 1)) << i;
  EXPECT_EQ(Log(1, 3, 10), 0U) << "before it was powered on";
}

TEST_F(ScUnitTest, ExcessiveShockOnEachAxisEitherWay) {
  Preset(53, 5000);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double mps2 : {50.02, -50.02}) {
      unit_.SetPower(false);
      Pass(kSecond);
      unit_.SetPower(true);
      Pass(kSecond);
      unit_.motor.Shock(axis, mps2 > 0 ? 49.9 : -49.9, unit_.now());
      Pass(1500 * kMillisecond);
      ASSERT_EQ(Status(), 0U);
      unit_.motor.Shock(axis, mps2, unit_.now());
      EXPECT_LE(UntilTrip(), 2 * GearMotor::kStep);
      EXPECT_EQ(Status(), 0x40U);
      EXPECT_EQ(static_cast<std::int16_t>(Log(1, static_cast<unsigned>(4 + axis), 19)), mps2 > 0 ? 5002 : -5002);
      EXPECT_EQ(Log(1, static_cast<unsigned>(4 + axis), 18), 0U);
    }
  }
  EXPECT_EQ(unit_.InputRegister(200), 6);
}

TEST_F(ScUnitTest, SeveralCausesAtOnceSetTheirBits) {
  Preset(0, 4000);
  Preset(2, 4500);
  Preset(9, 0);
  Preset(10, 0);
  Pass(5 * kSecond);
  unit_.motor.SetLoad(500);
  UntilTrip();
  EXPECT_EQ(Status(), 0x03U);
}

// Guideline 10, note 2: xx19 is the trip, xx00 19 x log acquisition time before; log 1 is the last trip.
TEST_F(ScUnitTest, LogsShiftAndFollowTheLogAcquisitionTime) {
  Preset(0, 4000);
  Preset(9, 0);
  Preset(54, 3);                                                                     // 0.3 s
  unit_.motor.SetProfile(LoadProfile::Parse("0:100,100:500").value(), unit_.now());  // 4 W/s
  while (unit_.motor.running()) Pass(kMillisecond);                                  // at 75 s
  EXPECT_EQ(Log(1, 2, 19), 4001U) << "the first step beyond 400 W";
  for (unsigned i = 0; i < 19; ++i) {
    EXPECT_NEAR(Log(1, 2, i), 4000 - 12.0 * (19 - i), 1.0) << i;
    EXPECT_EQ(Log(1, 0, i), 2000U) << i;
  }
  std::vector<unsigned> first;
  for (unsigned i = 0; i < 20; ++i) first.push_back(Log(1, 2, i));

  unit_.ResetTrip();
  unit_.WriteCoil(kCoilStart, true);
  unit_.motor.SetLoad(150);
  Preset(54, 100);
  Pass(200 * kSecond);
  ASSERT_TRUE(unit_.ForceTrip(kExcessiveShock));
  for (unsigned i = 0; i < 20; ++i) {
    EXPECT_EQ(Log(1, 2, i), 1500U) << i;
    EXPECT_EQ(Log(2, 2, i), first[i]) << i;
  }
  unit_.SetPower(false);
  unit_.SetPower(true);
  Pass(kSecond);
  ASSERT_TRUE(unit_.ForceTrip(kLowerB));
  for (unsigned i = 0; i < 20; ++i) EXPECT_EQ(Log(3, 2, i), first[i]) << i;
  EXPECT_EQ(unit_.InputRegister(200), 3);
  EXPECT_EQ(unit_.InputRegister(202), 0x08);
  EXPECT_EQ(unit_.InputRegister(203), 0x40);
  EXPECT_EQ(unit_.InputRegister(204), 0x01);

  unit_.SetPower(false);
  unit_.SetPower(true);
  unit_.ResetTrip();
  unit_.WriteCoil(kCoilStart, true);
  ASSERT_TRUE(unit_.ForceTrip(kUpperB));
  EXPECT_NE(Log(3, 2, 0), first[0]) << "the oldest is gone";
  EXPECT_EQ(unit_.InputRegister(204), 0x40);
}

// Guideline 10: all three logs in all seven quantities are what the instantaneous data were at their instants.
TEST_F(ScUnitTest, EveryLogSampleIsWhatTheLiveDataShowedThen) {
  Preset(52, 900);
  unit_.motor.settings.vibration_mps2 = 3;
  unit_.motor.settings.ambient_c = 20;
  unit_.motor.settings.heating_c_per_w = 0.2;
  unit_.motor.settings.thermal_s = 30;
  unit_.motor.SetProfile(LoadProfile::Parse("0:100,7:300,11:150").value(), unit_.now());
  constexpr std::array<std::uint16_t, 3> kIntervals = {7, 2, 10};  // of log 1, 2, 3: 0.1 s
  constexpr std::size_t kLast = 2499;                              // step of the trip
  std::array<std::vector<std::array<unsigned, 7>>, 3> seen;
  for (std::size_t log = 3; log-- > 0;) {
    Preset(54, kIntervals.at(log));
    unit_.motor.SetTemperature(40);
    unit_.SetPower(false);
    unit_.SetPower(true);
    for (std::size_t step = 0; step <= kLast; ++step) {
      unit_.motor.settings.voltage_v = 200 + static_cast<double>(step % 13);
      if (step == kLast) unit_.motor.SetTemperature(95);
      Pass(GearMotor::kStep);
      std::array<unsigned, 7>& row = seen.at(log).emplace_back();
      for (unsigned q = 0; q < 7; ++q) row.at(q) = unit_.InputRegister(static_cast<std::uint16_t>(100 + q));
    }
    ASSERT_EQ(Status(), 0x20U);
  }
  for (unsigned log = 0; log < 3; ++log) {
    EXPECT_EQ(Log(log + 1, 0, 19), 2000 + 10 * (kLast % 13));
    EXPECT_EQ(Log(log + 1, 3, 19), 950U);
    for (unsigned i = 0; i < 19; ++i) {
      const std::size_t before = std::size_t{10} * (19 - i) * kIntervals.at(log);
      for (unsigned q = 0; q < 7; ++q) {
        EXPECT_EQ(Log(log + 1, q, i), seen.at(log).at(kLast - before).at(q)) << log << ' ' << q << ' ' << i;
      }
    }
  }
}

TEST_F(ScUnitTest, AForcedTripShowsItsCauseInTheLastSample) {
  const auto forced = [&](std::uint16_t cause) {
    unit_.SetPower(false);
    unit_.SetPower(true);
    Pass(5 * kSecond);
    EXPECT_TRUE(unit_.ForceTrip(cause));
    EXPECT_FALSE(unit_.ForceTrip(cause)) << "it does not run";
    EXPECT_EQ(Status(), cause);
  };
  unit_.motor.SetLoad(200);
  Preset(0, 4000);
  Preset(9, 300);
  forced(kUpperA);
  EXPECT_EQ(Log(1, 2, 19), 4001U);
  EXPECT_EQ(Log(1, 2, 18), 2000U);
  Preset(6, 150);
  forced(kLowerB);
  EXPECT_EQ(Log(1, 2, 19), 149U);
  Preset(52, 900);
  forced(kOverheat);
  EXPECT_EQ(Log(1, 3, 19), 901U);
  Preset(53, 5000);
  forced(kExcessiveShock);
  EXPECT_EQ(Log(1, 4, 19), 5001U);
}

TEST_F(ScUnitTest, AResetByPowerStartsTheMotorAndKeepsCountLogsAndParameters) {
  Pass(5 * kSecond);
  ASSERT_TRUE(unit_.ForceTrip(kOverheat));
  unit_.SetPower(false);
  EXPECT_FALSE(unit_.motor.running());
  unit_.SetPower(true);
  EXPECT_TRUE(unit_.motor.running());
  EXPECT_EQ(Status(), 0U);
  EXPECT_EQ(unit_.InputRegister(200), 1);
  EXPECT_EQ(unit_.InputRegister(202), 0x20);
  EXPECT_EQ(Log(1, 0, 19), 2000U);
  EXPECT_EQ(unit_.HoldingRegister(54), 10);
}

TEST_F(ScUnitTest, StuckDataStandWhileTheMotorGoesOn) {
  unit_.SetStuck(true);
  unit_.motor.SetLoad(333);
  EXPECT_EQ(unit_.InputRegister(102), 2000);
  unit_.SetStuck(false);
  EXPECT_EQ(unit_.InputRegister(102), 3330);
}

TEST_F(ScUnitTest, RunUpDrawsMoreAndSpeedFollows) {
  unit_.motor.settings.run_up_w = 600;
  unit_.motor.settings.run_up_s = 0.5;
  unit_.motor.settings.speed_rpm = 30;
  unit_.motor.SetLoad(200);
  unit_.SetPower(false);
  unit_.SetPower(true);
  Pass(250 * kMillisecond);
  EXPECT_EQ(unit_.InputRegister(102), 6000);
  EXPECT_NEAR(unit_.motor.SpeedAt(unit_.now()), 15, 1);
  Pass(300 * kMillisecond);
  EXPECT_EQ(unit_.InputRegister(102), 2000);
  EXPECT_EQ(unit_.motor.SpeedAt(unit_.now()), 30);
}

// How often one looks changes nothing.
TEST_F(ScUnitTest, LongStepsGiveTheSameAsShortOnes) {
  const auto run = [](MonoNs step) {
    ScUnit unit(7);
    unit.Advance(kStart);
    unit.motor.SetProfile(LoadProfile::Parse("0:100,3:500,7:100").value(), kStart);
    unit.motor.settings.vibration_mps2 = 3;
    for (MonoNs t = 0; t <= 40 * kSecond; t += step) unit.Advance(kStart + t);
    unit.Advance(kStart + 40 * kSecond);
    std::vector<unsigned> values = {unit.InputRegister(200), unit.InputRegister(202), unit.InputRegister(104)};
    for (std::uint16_t i = 0; i < 20; ++i)
      values.push_back(unit.InputRegister(static_cast<std::uint16_t>(1200 + i)));
    return values;
  };
  EXPECT_EQ(run(7 * kMillisecond), run(40 * kSecond));
  EXPECT_EQ(run(kSecond)[0], 1U);
}

TEST(LoadProfileTest, IsReadAndRefused) {
  EXPECT_EQ(LoadProfile().Text(), "none");
  const Result<LoadProfile> profile = LoadProfile::Parse("0:100,2:300,4:100");
  ASSERT_TRUE(profile) << profile.error().text;
  EXPECT_EQ(profile->Text(), "0:100,2:300,4:100");
  EXPECT_DOUBLE_EQ(profile->At(0.5), 150);
  EXPECT_DOUBLE_EQ(profile->At(2), 300);
  EXPECT_DOUBLE_EQ(profile->At(4 * 1000 + 3), 200);
  for (const char* wrong : {"5", "1:100", "0:100,0:200", "0:100,2:x", "0:-1", "0:99999", ":", "0:1,,"}) {
    EXPECT_FALSE(LoadProfile::Parse(wrong)) << wrong;
  }
  const Result<LoadProfile> none = LoadProfile::Parse("none");
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->empty());
  const Result<LoadProfile> constant = LoadProfile::Parse("0:70");
  ASSERT_TRUE(constant);
  EXPECT_DOUBLE_EQ(constant->At(5), 70);
}

}  // namespace

}  // namespace axlecast::tsubaki_sc::simulator
