#include <gmock/gmock.h>
#include <unistd.h>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>

#include "tools/axlecast/command/trips_command.h"
#include "tools/axlecast/common/test_monitor.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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

std::string Svg(const std::string& device, const std::vector<trip_log_t>& trips) {
  return TripSvg(device, trips).value_or("");
}

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

// By Python's XML parser: well-formed, in the SVG namespace, every coordinate within the picture.
bool IsValidSvg(const std::string& svg) {
  const std::string file =
      (std::filesystem::temp_directory_path() / ("trip" + std::to_string(getpid()) + ".svg")).string();
  std::ofstream(file) << svg;
  const std::string check =
      "python3 - " + file +
      " <<'END'\n"
      "import re, sys, xml.etree.ElementTree as tree\n"
      "root = tree.parse(sys.argv[1]).getroot()\n"
      "name = '{http://www.w3.org/2000/svg}'\n"
      "assert root.tag == name + 'svg', root.tag\n"
      "left, top, width, height = map(float, root.get('viewBox').split())\n"
      "for e in root.iter():\n"
      "  assert e.tag.startswith(name), e.tag\n"
      "  if e.tag == name + 'path':\n"
      "    assert re.fullmatch(r'([ML]-?[0-9.]+ -?[0-9.]+)+', e.get('d')), e.get('d')\n"
      "    for x, y in re.findall(r'([0-9.-]+) ([0-9.-]+)', e.get('d')):\n"
      "      assert 0 <= float(x) <= width and 0 <= float(y) <= height, (x, y)\n"
      "  for key in ('x', 'x1', 'x2', 'cx'): assert 0 <= float(e.get(key, 0)) <= width, e.attrib\n"
      "  for key in ('y', 'y1', 'y2', 'cy'): assert 0 <= float(e.get(key, 0)) <= height, e.attrib\n"
      "END";
  const bool valid = std::system(check.c_str()) == 0;
  std::filesystem::remove(file);
  return valid;
}

TEST(TripSvg, HasSevenPanelsWithUnitsAndMarksTheTrip) {
  const std::string svg = Svg("gm3", {TripLog()});
  EXPECT_TRUE(IsValidSvg(svg));
  for (const char* title : {"voltage, V", "current, A", "power, W", "temperature, degC", "acceleration x, m/s2",
                            "acceleration y, m/s2", "acceleration z, m/s2"}) {
    EXPECT_EQ(Count(svg, std::string(">") + title + "<"), 1U) << title;
  }
  EXPECT_EQ(Count(svg, "time before the trip, s"), 7U);
  EXPECT_EQ(Count(svg, "<path "), 7U);
  EXPECT_EQ(Count(svg, "<circle cx=\"700.0\""), 7U);
  EXPECT_THAT(svg, Not(HasSubstr(">-0.00<")));
  EXPECT_THAT(svg, HasSubstr("trip 5, power upper A (newest)"));
  EXPECT_THAT(svg, HasSubstr("prefers-color-scheme:dark"));
  EXPECT_LT(svg.size(), 16'000U);
}

// 20 samples from -1.9 s at x = 80 to the trip at x = 700; the power rises from 100 W, the lower end of its axis,
// to 290 W.
TEST(TripSvg, ACurveRunsFromTheOldestSampleToTheTrip) {
  const std::string svg = Svg("gm3", {TripLog()});
  const std::size_t power = svg.find("<path", svg.find(">power, W<"));
  const std::string path = svg.substr(power, svg.find("/>", power) - power);
  EXPECT_EQ(Count(path, "M") + Count(path, "L"), 20U);
  EXPECT_THAT(path, HasSubstr("d=\"M80.0 480.0L112.6 475.5"));
  EXPECT_THAT(path, HasSubstr("L700.0 394.5\""));
  const std::string panel = svg.substr(svg.find(">power, W<"), svg.find(">temperature") - svg.find(">power, W<"));
  for (const char* round : {"100", "200", "300", "-1.5", "-1.0", "-0.5", "0.0"}) {
    EXPECT_EQ(Count(panel, std::string(">") + round + "<"), 1U) << round;
  }
  EXPECT_EQ(Count(panel, "<text "), 9U) << "and the titles of the time and of the next panel: no other mark";
}

TEST(TripSvg, ThreeTripsInOnePicture) {
  trip_log_t older = TripLog();
  older.interval_us = 500'000;
  const std::string svg = Svg("gm3", {TripLog(), older, older});
  EXPECT_TRUE(IsValidSvg(svg));
  EXPECT_EQ(Count(svg, "<path "), 21U);
  for (const char* style : {"c0", "c1", "c2"}) {
    EXPECT_EQ(Count(svg, std::string("class=\"") + style + '"'), 15U) << "7 curves, 7 trips, the legend";
  }
  EXPECT_THAT(svg, HasSubstr(">-8<")) << "the axis holds the longest, 9.5 s";
}

TEST(TripSvg, WhatWasNotReadIsLeftOut) {
  trip_log_t trip = TripLog();
  trip.valid_mask = 0x01;
  trip.samples[0][10] = std::numeric_limits<float>::quiet_NaN();
  const std::string svg = Svg("gm3", {trip});
  EXPECT_TRUE(IsValidSvg(svg));
  EXPECT_EQ(Count(svg, ">not read<"), 6U);
  EXPECT_EQ(Count(svg, "<path"), 1U);
  const std::size_t begin = svg.find("<path");
  EXPECT_EQ(Count(svg.substr(begin, svg.find("/>", begin) - begin), "M"), 2U) << "a gap, no line across it";
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(TripSvg, ANameIsNeverMarkup) {
  const std::string svg = Svg("<script>&\x1b\xEF\xBF\xBF", {TripLog()});
  EXPECT_THAT(svg, Not(HasSubstr("<script>")));
  EXPECT_THAT(svg, HasSubstr("&lt;script&gt;&amp;"));
  EXPECT_TRUE(IsValidSvg(svg));
}

TEST(TripSvg, ValuesFromTheNetworkCannotBreakIt) {
  trip_log_t trip = TripLog();
  trip.factor_bits = -1;
  trip.interval_us = INT32_MAX;
  trip.samples[0][0] = std::numeric_limits<float>::max();
  trip.samples[0][1] = std::numeric_limits<float>::lowest();
  trip.samples[1][3] = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(IsValidSvg(Svg("gm3", {trip})));
  trip.interval_us = -1;
  EXPECT_TRUE(IsValidSvg(Svg("gm3", {trip})));
  EXPECT_TRUE(IsValidSvg(Svg("gm3", {})));
}

}  // namespace

}  // namespace axlecast
