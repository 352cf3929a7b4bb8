#include "tools/convert/csv_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/convert/test_events.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

constexpr TimeGrid kTenMs = {.period_us = 10'000, .max_age_us = 20'000};

std::string Grid(const TestEvents& events, const TimeGrid& grid = kTenMs) {
  TestOutput output;
  const Conversion done = WriteCsvGrid(events.range(), events.range(), grid, output.sink());
  return done.problem.empty() ? output.text : done.problem;
}

TEST(CsvGrid, StandsOnTheLineBetweenReadings) {
  TestEvents events;
  events.Add(0, "POSITION/a", TestPosition(1'005'000, 0, 100));
  events.Add(0, "POSITION/a", TestPosition(1'015'000, 1, 200));
  events.Add(0, "POSITION/a", TestPosition(1'020'000, 2, 200));
  EXPECT_EQ(Grid(events),
            "utime,POSITION/a:value,POSITION/a:counts,POSITION/a:flags\r\n"
            "1010000,,150,1\r\n"
            "1020000,,200,1\r\n");
}

TEST(CsvGrid, NothingStandsAcrossARestartAnotherDatumOrAGap) {
  TestEvents events;
  const auto add = [&](std::int64_t utime, std::int64_t seq, std::int64_t boot, std::int32_t epoch) {
    position_t position = TestPosition(utime, seq, 0);
    position.boot_id = boot;
    position.datum_epoch = epoch;
    events.Add(0, "POSITION/a", position);
  };
  add(5'000, 0, 1, 0);
  add(15'000, 1, 1, 1);  // the datum was changed in between
  add(25'000, 0, 2, 1);  // the driver was started again
  add(65'000, 1, 2, 1);  // after 40 ms
  add(70'000, 2, 2, 1);
  EXPECT_EQ(Grid(events),
            "utime,POSITION/a:value,POSITION/a:counts,POSITION/a:flags\r\n"
            "10000,,,1\r\n"
            "20000,,,\r\n"
            "30000,,,1\r\n"
            "40000,,,1\r\n"
            "50000,,,\r\n"
            "60000,,,\r\n"
            "70000,,0,1\r\n");
}

TEST(CsvGrid, AChannelThatFallsSilentHoldsNothingUp) {
  TestEvents events;
  events.Add(0, "POSITION/a", TestPosition(0, 0, 0));
  for (int i = 0; i < 5'000; ++i) events.Add(0, "POSITION/b", TestPosition(10'000 * i, i, i));
  TestOutput output;
  output.room = 500;
  std::int64_t seen = 0;
  const EventRange counted = [&](const EventVisitor& visit) {
    seen = 0;
    events.range()([&](const LogEvent& event) {
      ++seen;
      return visit(event);
    });
  };
  const Conversion done = WriteCsvGrid(counted, events.range(), kTenMs, output.sink());
  EXPECT_GE(done.written, 499);
  EXPECT_LT(seen, 2'000);  // the output ended it: rows are written while the log is read
}

TEST(CsvGrid, WhatCannotBeOne) {
  TestEvents events;
  EXPECT_THAT(Grid(events), HasSubstr("POSITION"));
  events.Add(0, "POSITION/a", TestPosition(INT64_MIN, 0, 0));
  EXPECT_THAT(Grid(events), HasSubstr("--grid"));
  TestEvents late;
  late.Add(0, "POSITION/a", TestPosition(0, 0, 0));
  late.Add(0, "POSITION/a", TestPosition(INT64_MAX, 1, 0));
  EXPECT_THAT(Grid(late), HasSubstr("--grid"));
}

TEST(CsvGrid, AnInstantThatNoClockHasGivesNoRow) {
  TestEvents events;
  events.Add(0, "POSITION/a", TestPosition(INT64_MAX, 0, 100));
  EXPECT_EQ(Grid(events), "utime,POSITION/a:value,POSITION/a:counts,POSITION/a:flags\r\n");
}

}  // namespace
}  // namespace axlecast
