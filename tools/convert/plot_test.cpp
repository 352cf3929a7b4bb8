#include "tools/convert/plot.h"

#include <cairo.h>
#include <fontconfig/fontconfig.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tools/convert/conversion.h"
#include "tools/convert/curve.h"
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

}  // namespace
}  // namespace axlecast
