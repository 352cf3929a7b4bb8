#include "tools/axlecast/command/trip_table.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "tools/axlecast/live/trip_test_log.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

TEST(TripTable, ShowsCauseInstantAndTwentySamplesOldestFirst) {
  const std::string text = TripTable("gm3", {TripLog()});
  EXPECT_THAT(text, HasSubstr("gm3: trip 5, power upper A, between 2026-11-21 07:00:01 UTC and "
                              "2026-11-21 07:00:05 UTC\n"));
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 22) << "a title, a heading, 20 samples";
  EXPECT_THAT(text, HasSubstr("      s        V        A        W     degC   x m/s2   y m/s2   z m/s2\n"
                              "   -1.9    230.5    0.500    100.0     45.0     0.00     0.00     9.81\n"));
  EXPECT_THAT(text, HasSubstr("    0.0    230.5    0.500    290.0     45.0     0.00     0.00     9.81  trip\n"));
}

TEST(TripTable, WhatIsNotKnownIsNotInvented) {
  trip_log_t trip = TripLog();
  trip.valid_mask = 0x7F & ~0x02;  // the current was not read
  trip.interval_us = 0;
  trip.factor_bits = 0;
  trip.trip_count = 0;
  trip.not_before_utime = 0;
  const std::string text = TripTable("gm3", {trip});
  EXPECT_THAT(text, HasSubstr("gm3: a trip, cause unknown, before 2026-11-21 07:00:05 UTC\n"));
  EXPECT_THAT(text, HasSubstr(" sample        V"));
  EXPECT_THAT(text, HasSubstr("    -19    230.5        -    100.0"));
  trip.not_after_utime = 0;
  EXPECT_THAT(TripTable("gm3", {trip}), HasSubstr("at an unknown time"));
}

TEST(TripTable, SeveralTripsStandApart) {
  trip_log_t older = TripLog();
  older.trip_count = 4;
  older.factor_bits = 0x60;
  EXPECT_THAT(TripTable("gm3", {TripLog(), older}), HasSubstr("trip\n\ngm3: trip 4, overheat, excessive shock, "));
  EXPECT_EQ(TripTable("gm3", {}), "");
}

TEST(TripTable, AnAbsurdInstantIsNoCrash) {
  trip_log_t trip = TripLog();
  trip.not_after_utime = INT64_MAX;
  trip.not_before_utime = INT64_MIN;
  EXPECT_THAT(TripTable("gm3", {trip}), HasSubstr("between"));
}

}  // namespace
}  // namespace axlecast
