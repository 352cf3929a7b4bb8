#include "drivers/runtime/axis/device_publisher.h"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

using ::testing::SizeIs;

constexpr MonoNs kStart = 1'000 * kSecond;
constexpr std::int64_t kUtcAtZero = 1'700'000'000'000'000;
constexpr int kAnalogValid = motor_health_t::FLAG_ANALOG_VALID;
constexpr int kStatusValid = motor_health_t::FLAG_STATUS_VALID;
constexpr int kTripped = motor_health_t::FLAG_TRIPPED;
constexpr int kSimulated = motor_health_t::FLAG_SIMULATED;

MotorReading ReadingAt(MonoNs at) {
  MotorReading reading;
  reading.analog_at = {at, at + 20 * kMillisecond};
  reading.voltage_v = 200.5F;
  reading.current_a = 1.25F;
  reading.power_w = 150.1F;
  reading.temperature_c = -3.5F;
  reading.accel_mps2 = {0.01F, -9.81F, 1.0F};
  reading.status_at = {at + 130 * kMillisecond, at + 150 * kMillisecond};
  reading.trip_count = 3;
  reading.status_bits = 0x22;
  reading.trip_factor = {0x20, 0x02, 0};
  reading.tripped = true;
  reading.stop_coil = 1;
  reading.mains_hz = 60;
  return reading;
}

class MotorOutputTest : public ::testing::Test {
 protected:
  MotorOutputTest() { time_.Update(0, kUtcAtZero); }

  std::vector<motor_health_t> Motors() const { return sink_.All<motor_health_t>("MOTOR/gm3"); }
  std::vector<trip_log_t> Trips() const { return sink_.All<trip_log_t>("TRIP/gm3"); }

  Timebase time_;
  MemorySink sink_;
  MotorOutput output_{
      "gm3", 10, {.origin = {.boot_id = 5}, .time = &time_, .sink = &sink_, .on_outcome = {}}, true};
};

TEST_F(MotorOutputTest, TheMessageHoldsTheReading) {
  output_.Take(ReadingAt(kStart));
  ASSERT_THAT(Motors(), SizeIs(1));
  const motor_health_t motor = Motors()[0];
  EXPECT_EQ(motor.boot_id, 5);
  EXPECT_EQ(motor.seq, 0);
  EXPECT_EQ(motor.mono_ns, kStart + 10 * kMillisecond);
  EXPECT_EQ(motor.utime, kUtcAtZero + (kStart + 10 * kMillisecond) / kMicrosecond);
  EXPECT_EQ(motor.analog_mono_ns, kStart + 10 * kMillisecond);
  EXPECT_EQ(motor.status_mono_ns, kStart + 140 * kMillisecond);
  EXPECT_FLOAT_EQ(motor.voltage_v, 200.5F);
  EXPECT_FLOAT_EQ(motor.current_a, 1.25F);
  EXPECT_FLOAT_EQ(motor.power_w, 150.1F);
  EXPECT_FLOAT_EQ(motor.temperature_c, -3.5F);
  EXPECT_FLOAT_EQ(motor.accel_mps2[1], -9.81F);
  EXPECT_EQ(motor.trip_count, 3);
  EXPECT_EQ(motor.status_bits, 0x22);
  EXPECT_EQ(motor.trip_factor[1], 2);
  EXPECT_EQ(motor.stop_coil, 1);
  EXPECT_EQ(motor.logged_in, -1);
  EXPECT_EQ(motor.mains_hz, 60);
  EXPECT_EQ(motor.flags, kAnalogValid | kStatusValid | kTripped | kSimulated);
}

TEST_F(MotorOutputTest, WhatWasNeverReadIsUnknownAndItsFlagIsClear) {
  MotorReading reading;
  reading.status_at = {kStart, kStart + 1};
  output_.Take(reading);
  ASSERT_THAT(Motors(), SizeIs(1));
  EXPECT_TRUE(std::isnan(Motors()[0].voltage_v));
  EXPECT_TRUE(std::isnan(Motors()[0].accel_mps2[2]));
  EXPECT_EQ(Motors()[0].flags, kStatusValid | kSimulated);
  EXPECT_EQ(Motors()[0].mono_ns, kStart + 1);
}

TEST_F(MotorOutputTest, IsPublishedAtMostAtItsRate) {
  for (int i = 0; i < 100; ++i) output_.Take(ReadingAt(kStart + i * 25 * kMillisecond));
  EXPECT_THAT(Motors(), SizeIs(25));
  EXPECT_EQ(Motors().back().seq, 24);
}

TEST_F(MotorOutputTest, EveryTripOnceAndTheNewestEachMinute) {
  TripRecord record;
  record.at = {kStart, kStart + kSecond};
  record.log_index = 1;
  record.trip_count = 4;
  record.factor_bits = 0x40;
  record.not_before = kStart - kSecond;
  record.not_after = kStart + kSecond / 2;
  record.interval_us = 500'000;
  record.valid_mask = 0x7F;
  record.samples[6][19] = 12.5F;
  output_.Take(record);
  record.log_index = 2;
  record.trip_count = 3;
  output_.Take(record);
  ASSERT_THAT(Trips(), SizeIs(2));
  EXPECT_EQ(Trips()[1].seq, 1);
  const trip_log_t trip = Trips()[0];
  EXPECT_EQ(trip.device, "gm3");
  EXPECT_EQ(trip.trip_count, 4);
  EXPECT_EQ(trip.not_before_utime, kUtcAtZero + (kStart - kSecond) / kMicrosecond);
  EXPECT_EQ(trip.not_after_utime, kUtcAtZero + (kStart + kSecond / 2) / kMicrosecond);
  EXPECT_EQ(trip.boot_id, 5);
  EXPECT_EQ(trip.seq, 0);
  EXPECT_EQ(trip.mono_ns, kStart + kSecond);
  EXPECT_EQ(trip.utime, kUtcAtZero + (kStart + kSecond) / kMicrosecond);
  EXPECT_EQ(trip.factor_bits, 0x40);
  EXPECT_EQ(trip.interval_us, 500'000);
  EXPECT_EQ(trip.valid_mask, 0x7F);
  EXPECT_FLOAT_EQ(trip.samples[6][19], 12.5F);
  for (int s = 0; s <= 121; ++s) output_.Tick(kStart + kSecond + s * kSecond);
  ASSERT_THAT(Trips(), SizeIs(4));
  EXPECT_EQ(Trips()[3].trip_count, 4);
  EXPECT_EQ(Trips()[3].log_index, 1);
  EXPECT_EQ(Trips()[3].utime, trip.utime) << "when it was read";
  EXPECT_EQ(Trips()[3].seq, 3);
}

// ---- limits ----

class MotorLimitsTest : public MotorOutputTest {
 protected:
  std::vector<motor_limits_t> Limits() const { return sink_.All<motor_limits_t>("LIMITS/gm3"); }

  static MotorLimits At(MonoNs at, float watts) {
    MotorLimits limits;
    limits.at = {at, at + 2 * kMillisecond};
    limits.power_upper_w = {watts, 2 * watts};
    limits.overheat_c = 90;
    limits.parameters[52] = 90;
    return limits;
  }
};

TEST_F(MotorLimitsTest, AreSentWhenOneChangesAndOnceAMinute) {
  output_.Tick(kStart);
  EXPECT_THAT(Limits(), SizeIs(0)) << "none are known";
  for (int i = 0; i < 50; ++i) output_.Take(At(kStart + i * kSecond, 150), kStart + i * kSecond);
  ASSERT_THAT(Limits(), SizeIs(1));
  const motor_limits_t first = Limits()[0];
  EXPECT_EQ(first.boot_id, 5);
  EXPECT_EQ(first.seq, 0);
  EXPECT_EQ(first.mono_ns, kStart + kMillisecond);
  EXPECT_EQ(first.utime, kUtcAtZero + first.mono_ns / kMicrosecond);
  EXPECT_FLOAT_EQ(first.power_upper_w[0], 150);
  EXPECT_FLOAT_EQ(first.power_upper_w[1], 300);
  EXPECT_TRUE(std::isnan(first.power_lower_w[0]));
  EXPECT_TRUE(std::isnan(first.start_time_s));
  EXPECT_FLOAT_EQ(first.overheat_c, 90);
  EXPECT_FLOAT_EQ(first.parameters[52], 90);
  EXPECT_TRUE(std::isnan(first.parameters[0]));
  EXPECT_EQ(first.flags, motor_limits_t::FLAG_SIMULATED);
  output_.Tick(kStart + 59 * kSecond);
  EXPECT_THAT(Limits(), SizeIs(1));
  output_.Tick(kStart + 60 * kSecond);
  ASSERT_THAT(Limits(), SizeIs(2));
  EXPECT_EQ(Limits()[1].seq, 1);
  EXPECT_EQ(Limits()[1].mono_ns, kStart + 49 * kSecond + kMillisecond) << "of the newest reading";
  output_.Take(At(kStart + 61 * kSecond, 151), kStart + 61 * kSecond);
  EXPECT_THAT(Limits(), SizeIs(3));
  output_.Tick(kStart + 120 * kSecond);
  EXPECT_THAT(Limits(), SizeIs(3));
  output_.Tick(kStart + 121 * kSecond);
  EXPECT_THAT(Limits(), SizeIs(4));
}

TEST_F(MotorLimitsTest, EachValueCountsAsAChange) {
  const auto changed = [&](auto change) {
    MotorLimits limits = At(kStart, 150);
    output_.Take(limits, kStart);
    const std::size_t before = Limits().size();
    change(limits);
    output_.Take(limits, kStart);
    return Limits().size() == before + 1;
  };
  EXPECT_TRUE(changed([](MotorLimits& l) { l.power_upper_w[1] = 1; }));
  EXPECT_TRUE(changed([](MotorLimits& l) { l.power_lower_w[0] = 1; }));
  EXPECT_TRUE(changed([](MotorLimits& l) { l.start_time_s = 1; }));
  EXPECT_TRUE(changed([](MotorLimits& l) { l.shock_time_upper_s[0] = 1; }));
  EXPECT_TRUE(changed([](MotorLimits& l) { l.shock_time_lower_s[1] = 1; }));
  EXPECT_TRUE(changed([](MotorLimits& l) { l.overheat_c = 1; }));
  EXPECT_TRUE(changed([](MotorLimits& l) { l.shock_mps2 = 1; }));
  EXPECT_TRUE(changed([](MotorLimits& l) { l.log_interval_s = 1; }));
  EXPECT_TRUE(changed([](MotorLimits& l) { l.parameters[54] = 1; }));
  EXPECT_FALSE(changed([](MotorLimits& l) { l.at.last += kSecond; }));
}

TEST_F(MotorOutputTest, WithoutARateEveryReadingIsPublished) {
  MotorOutput all("gm4", 0, {.origin = {}, .time = &time_, .sink = &sink_, .on_outcome = {}, .redecoded = true},
                  false);
  for (int i = 0; i < 3; ++i) all.Take(ReadingAt(kStart + i));
  const auto motors = sink_.All<motor_health_t>("MOTOR/gm4");
  ASSERT_THAT(motors, SizeIs(3));
  EXPECT_EQ(motors[0].flags, kAnalogValid | kStatusValid | kTripped | motor_health_t::FLAG_REDECODED);
}

TEST_F(MotorOutputTest, WithoutARateEveryReadingOfOneTimeIsPublished) {
  MotorOutput all("gm4", 0, {.origin = {}, .time = &time_, .sink = &sink_, .on_outcome = {}}, false);
  for (int i = 0; i < 3; ++i) all.Take(ReadingAt(kStart));
  EXPECT_THAT(sink_.All<motor_health_t>("MOTOR/gm4"), SizeIs(3));
}

TEST_F(MotorOutputTest, OneHertzIsARate) {
  MotorOutput slow("gm4", 1, {.origin = {}, .time = &time_, .sink = &sink_, .on_outcome = {}}, false);
  for (int i = 0; i <= 20; ++i) slow.Take(ReadingAt(kStart + i * 100 * kMillisecond));
  EXPECT_THAT(sink_.All<motor_health_t>("MOTOR/gm4"), SizeIs(3));
}

TEST_F(MotorOutputTest, TheFirstReadingSoonAfterTheBootOfTheHostIsPublished) {
  MotorReading reading;
  reading.status_at = {1, kMillisecond};
  output_.Take(reading);
  EXPECT_THAT(Motors(), SizeIs(1));
}

TEST_F(MotorOutputTest, AReadingMayComeUpToATenthEarly) {
  output_.Take(ReadingAt(kStart));
  output_.Take(ReadingAt(kStart + 90 * kMillisecond - 1));
  EXPECT_THAT(Motors(), SizeIs(1));
  output_.Take(ReadingAt(kStart + 90 * kMillisecond));
  EXPECT_THAT(Motors(), SizeIs(2));
  EXPECT_EQ(Motors()[1].seq, 1);
}

TEST_F(MotorOutputTest, WithoutAStatusItHasTheTimeOfTheQuantities) {
  MotorReading reading = ReadingAt(kStart);
  reading.status_at = {};
  reading.tripped = false;
  output_.Take(reading);
  ASSERT_THAT(Motors(), SizeIs(1));
  EXPECT_EQ(Motors()[0].flags, kAnalogValid | kSimulated);
  EXPECT_EQ(Motors()[0].status_mono_ns, 0);
  EXPECT_EQ(Motors()[0].mono_ns, kStart + 10 * kMillisecond);
  output_.Take(ReadingAt(kStart + 100 * kMillisecond));
  EXPECT_THAT(Motors(), SizeIs(2));
}

TEST_F(MotorOutputTest, ATripOfUnknownTimeHasNone) {
  TripRecord record;
  record.at = {kStart, kStart};
  output_.Take(record);
  ASSERT_THAT(Trips(), SizeIs(1));
  EXPECT_EQ(Trips()[0].not_before_utime, 0);
  EXPECT_EQ(Trips()[0].not_after_utime, 0);
  output_.Tick(kStart + MotorOutput::kRepeat - 1);
  EXPECT_THAT(Trips(), SizeIs(1));
  output_.Tick(kStart + MotorOutput::kRepeat);
  EXPECT_THAT(Trips(), SizeIs(2));
  output_.Tick(kStart + 2 * MotorOutput::kRepeat - 1);
  EXPECT_THAT(Trips(), SizeIs(2)) << "a minute after the last one";
}

TEST_F(MotorOutputTest, AnOlderTripIsNotRepeated) {
  TripRecord record;
  record.at = {kStart, kStart};
  record.log_index = 2;
  output_.Take(record);
  output_.Tick(kStart + 2 * MotorOutput::kRepeat);
  EXPECT_THAT(Trips(), SizeIs(1));
}

TEST_F(MotorLimitsTest, OfARecordingHaveItsFlag) {
  MotorOutput output("gm5", 10, {.origin = {}, .time = &time_, .sink = &sink_, .on_outcome = {}, .redecoded = true},
                     false);
  output.Take(At(kStart, 150), kStart);
  const auto limits = sink_.All<motor_limits_t>("LIMITS/gm5");
  ASSERT_THAT(limits, SizeIs(1));
  EXPECT_EQ(limits[0].flags, motor_limits_t::FLAG_REDECODED);
}

}  // namespace
}  // namespace axlecast
