#include "tools/axlecast/command/offset_command.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

position_t Reading(std::int64_t counts, double rpm = 0) {
  position_t reading = PositionMessage(0);
  reading.counts = counts;
  reading.speed_rad_s = rpm * 6.283185307179586 / 60;
  return reading;
}

device_info_t Info(std::int64_t datum_counts) {
  device_info_t info = DeviceMessage(device_info_t::STATE_ONLINE);
  info.boot_id = 7;
  info.datum_counts = datum_counts;
  return info;
}

// docs/positions.md: counts = direction x unwrapped - datum; 5 mm a turn of 131072 counts.
TEST(OffsetCapture, TheDatumMakesTheMeanReadTheValue) {
  OffsetCapture capture(4);
  capture.On(Info(1'000));
  for (const std::int64_t counts : {131'070, 131'072, 131'073, 131'073}) {
    EXPECT_FALSE(capture.done());
    capture.On(Reading(counts));
  }
  ASSERT_TRUE(capture.done());
  EXPECT_EQ(ErrorText(capture.state()), "");
  EXPECT_DOUBLE_EQ(capture.counts(), 132'072);
  EXPECT_EQ(capture.spread(), 3);
  EXPECT_EQ(capture.Datum(0), 132'072);
  EXPECT_EQ(capture.Datum(5), 1'000);
  EXPECT_EQ(capture.Datum(-2.5), 132'072 + 65'536);
  EXPECT_THAT(capture.Text("axis1", 5), HasSubstr("datum: {counts: 1000}"));
  EXPECT_EQ(capture.Json("axis1", 5)["datum"], 1'000);
}

TEST(OffsetCapture, RefusesWhileItTurnsAndSaysTheSpeed) {
  OffsetCapture capture(2);
  capture.On(Info(0));
  capture.On(Reading(0, -60));
  EXPECT_THAT(ErrorText(capture.state()), HasSubstr("-60.00 rpm"));
  EXPECT_TRUE(capture.done());
}

TEST(OffsetCapture, RefusesWhatMovedWithoutASpeed) {
  OffsetCapture capture(10);
  for (const std::int64_t counts : {0, 100, 200}) {
    position_t reading = Reading(counts);
    reading.flags = position_t::FLAG_VALID;
    capture.On(reading);
  }
  EXPECT_THAT(ErrorText(capture.state()), HasSubstr("0.549 degrees"));
}

TEST(OffsetCapture, RefusesWhatDoesNotBelongTogether) {
  OffsetCapture datum(2);
  datum.On(Reading(0));
  position_t reading = Reading(0);
  reading.datum_epoch = 1;
  datum.On(reading);
  EXPECT_THAT(ErrorText(datum.state()), HasSubstr("datum changed"));
  OffsetCapture boot(2);
  boot.On(Reading(0));
  reading = Reading(0);
  reading.boot_id = 8;
  boot.On(reading);
  EXPECT_THAT(ErrorText(boot.state()), HasSubstr("restarted"));
}

TEST(OffsetCapture, OnlyValidReadingsOfTheSameDriverCount) {
  OffsetCapture capture(1);
  position_t doubtful = Reading(5);
  doubtful.flags = 0;
  capture.On(doubtful);
  EXPECT_EQ(capture.count(), 0);
  device_info_t other = Info(0);
  other.boot_id = 6;
  capture.On(other);
  capture.On(Reading(5));
  EXPECT_FALSE(capture.done());  // the DEVICE of an earlier start is no measure
  capture.On(Info(0));
  EXPECT_TRUE(capture.done());
}

}  // namespace
}  // namespace axlecast
