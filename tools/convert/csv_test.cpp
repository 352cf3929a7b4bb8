#include "tools/convert/conversion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/convert/test_events.h"

namespace axlecast {
namespace {

// RFC 4180, section 2.
TEST(CsvLine, QuotesWhatNeedsIt) {
  EXPECT_EQ(CsvLine({"aaa", "bbb", "ccc"}), "aaa,bbb,ccc\r\n");
  EXPECT_EQ(CsvLine({"aaa", "b \r\nbb", "ccc"}), "aaa,\"b \r\nbb\",ccc\r\n");
  EXPECT_EQ(CsvLine({"aaa", "b\"bb", "c,c"}), "aaa,\"b\"\"bb\",\"c,c\"\r\n");
  EXPECT_EQ(CsvLine({"", ""}), ",\r\n");
}

// OWASP, "CSV Injection".
TEST(CsvLine, HasNoFormulas) {
  EXPECT_EQ(CsvLine({"=1+1", "+A1", "@SUM(A1)", "-2+3", "\tx"}), "'=1+1,'+A1,'@SUM(A1),'-2+3,'\tx\r\n");
  EXPECT_EQ(CsvLine({"\r=1", "=HYPERLINK(\"http://x\",1)"}), "\"'\r=1\",\"'=HYPERLINK(\"\"http://x\"\",1)\"\r\n");
  EXPECT_EQ(CsvLine({"-12.5", "-1e-05", "-0", "12", "a=b", "-"}), "-12.5,-1e-05,-0,12,a=b,'-\r\n");
}

TEST(CsvLine, IsAlwaysText) {
  EXPECT_EQ(CsvLine({"\xFF", std::string("a\0b", 3)}),
            "\xEF\xBF\xBD,a\xEF\xBF\xBD"
            "b\r\n");
}

using testing::HasSubstr;

constexpr TimeGrid kTenMs = {.period_us = 10'000, .max_age_us = 20'000};

std::string Grid(const TestEvents& events, const TimeGrid& grid = kTenMs) {
  TestOutput output;
  const Result<Conversion> done = WriteCsvGrid(events.range(), events.range(), grid, output.sink());
  return done ? output.text : done.error().text;
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
  const Result<Conversion> done = WriteCsvGrid(counted, events.range(), kTenMs, output.sink());
  EXPECT_GE(done->written, 499);
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
