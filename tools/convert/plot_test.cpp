#include "tools/convert/plot.h"

#include <cairo.h>
#include <fontconfig/fontconfig.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "tools/convert/conversion.h"
#include "tools/convert/test_events.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using testing::SizeIs;

const PlotField kValue = {"POSITION/a", "value"};

TEST(PlotFieldText, ChannelAndField) {
  const auto field = ParsePlotField("a:b/axis1:accel_mps2[0]");
  ASSERT_TRUE(field);
  EXPECT_EQ(field->channel, "a:b/axis1");
  EXPECT_EQ(field->field, "accel_mps2[0]");
  for (const char* text : {"", ":", "a", "a:", ":b"}) EXPECT_FALSE(ParsePlotField(text)) << text;
}

TEST(PlotFieldText, UnitsByTheMessageOrTheName) {
  EXPECT_EQ(FieldUnit({{"unit", position_t::UNIT_MM}}, "value"), "mm");
  EXPECT_EQ(FieldUnit({}, "value"), "");
  EXPECT_EQ(FieldUnit({}, "speed_rad_s"), "rad/s");
  EXPECT_EQ(FieldUnit({}, "angle_rad"), "rad");
  EXPECT_EQ(FieldUnit({}, "accel_mps2[1]"), "m/s²");
  EXPECT_EQ(FieldUnit({}, "raw_counts"), "counts");
  EXPECT_EQ(FieldUnit({}, "flags"), "");
}

TEST(MessageGap, IsFarAboveTheUsualTime) {
  MessageGap gap;
  EXPECT_EQ(gap.Limit(), INT64_MAX);
  for (std::int64_t i = 0; i < 100; ++i) gap.On(1'000 * i);
  gap.On(10'000'000);
  EXPECT_GE(gap.Limit(), 8'000);
  EXPECT_LE(gap.Limit(), 16'000);
}

TEST(SampleTime, IsTheMessagesUnlessItCannotBeATime) {
  TestEvents events;
  events.Add(7, "a", TestPosition(5, 0, 0));
  events.Add(7, "a", TestPosition(-1, 0, 0));
  events.Add(7, "a", TestPosition(INT64_MAX, 0, 0));
  events.AddRaw(7, "b", {1, 2, 3});
  events.AddRaw(-9, "b", {});
  std::vector<std::int64_t> times;
  events.range()([&](const LogEvent& event) {
    times.push_back(SampleTime(event));
    return true;
  });
  EXPECT_EQ(times, (std::vector<std::int64_t>{5, 7, 7, 7, 0}));
}

TEST(PlotData, LinesEndWhereMessagesAreMissingOrNotValid) {
  TestEvents events;
  std::int64_t seq = 0;
  for (std::int64_t i = 0; i < 100; ++i) {
    position_t position = TestPosition(1'000 * i, seq++, i);
    if (i == 20) position.flags = 0;
    if (i == 40) position.seq = seq++;      // one is missing
    if (i >= 60) position.boot_id = 2;      // the driver was started again
    if (i >= 80) position.utime += 30'000;  // nothing came for 31 ms
    if (i == 90) position.value = std::numeric_limits<double>::quiet_NaN();
    events.Add(1'000 * i, "POSITION/a", position);
  }
  const Result<PlotData> data = CollectPlot(events.range(), {kValue}, 10'000);
  ASSERT_TRUE(data);
  ASSERT_THAT(data->curves, SizeIs(1));
  EXPECT_EQ(data->curves[0].readings, 98);
  EXPECT_EQ(data->curves[0].unit, "count");
  std::vector<std::int64_t> begins;
  for (const Curve::Piece& piece : data->curves[0].pieces) begins.push_back(piece.front().us / 1'000);
  EXPECT_EQ(begins, (std::vector<std::int64_t>{0, 21, 40, 60, 110, 121}));
}

TEST(PlotData, SaysWhatThereIsInstead) {
  TestEvents events;
  events.Add(0, "POSITION/a", TestPosition(0, 0, 0));
  events.AddRaw(0, "CAMERA", {1});
  EXPECT_THAT(CollectPlot(events.range(), {{"POSITION/b", "value"}}, 10).error().text,
              HasSubstr("CAMERA, POSITION/a"));
  EXPECT_THAT(CollectPlot(events.range(), {{"POSITION/a", "boot_id"}}, 10).error().text, HasSubstr("speed_rad_s"));
  EXPECT_THAT(CollectPlot(events.range(), {{"CAMERA", "x"}}, 10).error().text, HasSubstr("not axlecast messages"));
}

// Cairo and fontconfig keep their fonts until the process ends. The address sanitizer would report a leak.
class FontCache : public testing::Environment {
 public:
  void TearDown() override {
    cairo_debug_reset_static_data();
    FcFini();
  }
};
const testing::Environment* const kFontCache = testing::AddGlobalTestEnvironment(new FontCache);

TEST(PlotPicture, NamesCannotBeMarkup) {
  TestEvents events;
  events.Add(0, "<b>&\x01\xFF", TestPosition(0, 0, 0));
  const Result<PlotData> data = CollectPlot(events.range(), {{"<b>&\x01\xFF", "value"}}, kPlotColumns);
  ASSERT_TRUE(data);
  EXPECT_THAT(*PlotSvg("</title>", *data), HasSubstr(">&lt;b&gt;&amp;\xEF\xBF\xBD\xEF\xBF\xBD:value<"));
  EXPECT_THAT(*PlotSvg("</title>", *data), HasSubstr("<title>&lt;/title&gt;</title>"));
  EXPECT_EQ(PlotPng("t", *data)->substr(1, 3), "PNG");
}

constexpr std::int64_t kNoGap = INT64_MAX;

TEST(Curve, FewReadingsStayAsTheyAre) {
  Curve curve(0, 1'000, kNoGap, 100);
  const Curve::Piece readings = {{0, 1}, {300, -2}, {301, 5}, {1'000, 0}};
  for (const CurvePoint& point : readings) curve.Add(point.us, point.value);
  EXPECT_EQ(curve.Pieces(), std::vector<Curve::Piece>{readings});
}

// Of 10^6 readings each column keeps the extremes that a brute-force search finds, and the points stay in order.
TEST(Curve, ManyReadingsKeepTheirExtremes) {
  constexpr std::int64_t kReadings = 1'000'000;
  constexpr std::size_t kColumns = 300;
  Curve curve(0, kReadings - 1, kNoGap, kColumns);
  const auto value = [](std::int64_t i) {
    return std::sin(static_cast<double>(i) * 1e-4) + (i % 7'777 == 0 ? 3 : 0) +
           static_cast<double>(i * 7'919 % 100) / 1e3;
  };
  const auto column = [](std::int64_t i) {
    return static_cast<std::size_t>(static_cast<double>(i) / (kReadings - 1) * kColumns);
  };
  std::map<std::size_t, std::pair<double, double>> expected;
  for (std::int64_t i = 0; i < kReadings; ++i) {
    curve.Add(i, value(i));
    auto [place, fresh] = expected.try_emplace(std::min(column(i), kColumns - 1), value(i), value(i));
    place->second.first = std::min(place->second.first, value(i));
    place->second.second = std::max(place->second.second, value(i));
  }
  EXPECT_EQ(curve.readings(), kReadings);
  const auto pieces = curve.Pieces();
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_LE(pieces[0].size(), 4 * kColumns);
  EXPECT_TRUE(std::is_sorted(pieces[0].begin(), pieces[0].end(), [](auto& a, auto& b) { return a.us < b.us; }));
  std::map<std::size_t, std::pair<double, double>> found;
  for (const CurvePoint& point : pieces[0]) {
    EXPECT_EQ(point.value, value(point.us));
    auto [place, fresh] = found.try_emplace(std::min(column(point.us), kColumns - 1), point.value, point.value);
    place->second.first = std::min(place->second.first, point.value);
    place->second.second = std::max(place->second.second, point.value);
  }
  EXPECT_EQ(found, expected);
}

TEST(Curve, GapsBreaksAndStepsBackAreNotJoined) {
  Curve curve(0, 1'000, 100, 1'000);
  curve.Add(0, 1);
  curve.Add(100, 2);
  curve.Add(201, 3);  // after a gap
  curve.Break();
  curve.Add(202, 4);
  curve.Add(150, 5);  // the clock was stepped back: a piece of its own
  EXPECT_EQ(curve.Pieces(), (std::vector<Curve::Piece>{{{0, 1}, {100, 2}}, {{150, 5}}, {{201, 3}}, {{202, 4}}}));
}

TEST(Curve, WhatIsOutsideIsDrawnAtTheEnds) {
  Curve curve(100, 200, kNoGap, 10);
  curve.Add(INT64_MIN, 1);
  curve.Add(INT64_MAX, 2);
  EXPECT_EQ(curve.Pieces(), (std::vector<Curve::Piece>{{{100, 1}, {200, 2}}}));
  EXPECT_TRUE(Curve(5, 5, kNoGap, 10).Pieces().empty());
}

}  // namespace
}  // namespace axlecast
