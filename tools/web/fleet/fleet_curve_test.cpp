#include "tools/web/fleet/fleet_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/position_t.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tools/fleet/column.h"
#include "tools/web/fleet/fleet_curve_source.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Json = nlohmann::ordered_json;

constexpr std::int64_t kT0 = 1'790'000'000'000'000;
const FleetRequest kRequest = {.kind = FleetRequest::Kind::kCurve,
                               .id = 5,
                               .machine = "m",
                               .device = "axis1",
                               .column = "value",
                               .from = kT0,
                               .to = kT0 + 1000};

std::string Body(const std::vector<std::int64_t>& times, const std::vector<std::int64_t>& counts,
                 const std::vector<std::int64_t>& flags) {
  std::vector<std::uint8_t> body;
  BeginBody(body, 3);
  AppendColumn(body, ColumnId::kTime, times);
  AppendColumn(body, ColumnId::kCounts, counts);
  AppendColumn(body, ColumnId::kFlags, flags);
  return {body.begin(), body.end()};
}

TEST(AppendSamples, TakesValidCountsWithinTheTimeInTheUnitOfTheStream) {
  const std::string body = Body({0, 10, 20, 30}, {100, 101, -102, 103}, {1, 0, 1, 1});
  std::vector<FleetCurvePoint> points;
  ASSERT_TRUE(AppendSamples(points, {.t0 = kT0, .n = 4, .body = body, .stream = 7, .scale = 0.5}, kT0, kT0 + 30));
  ASSERT_EQ(points.size(), 3U);
  EXPECT_EQ(points[0], (FleetCurvePoint{kT0, 50, 50, 50, 7}));
  EXPECT_TRUE(std::isnan(points[1].value));
  EXPECT_EQ(points[2].value, -51);
}

TEST(AppendSamples, RefusesADamagedBody) {
  std::vector<FleetCurvePoint> points;
  EXPECT_FALSE(AppendSamples(points, {.t0 = kT0, .n = 4, .body = "nonsense"}, kT0, kT0 + 30));
  EXPECT_FALSE(AppendSamples(points, {.t0 = kT0, .n = 0, .body = Body({0}, {1}, {1})}, kT0, kT0 + 30));
  EXPECT_FALSE(AppendSamples(points, {.t0 = kT0, .n = 1'000'000'000, .body = Body({0}, {1}, {1})}, kT0, kT0 + 30));
  EXPECT_THAT(points, IsEmpty());
}

TEST(Thin, KeepsFewPointsAndEveryPeak) {
  FleetCurve curve;
  for (int i = 0; i < 100'000; ++i) curve.points.push_back({kT0 + i * 1000, 1, 1, 1, 1});
  curve.points[54'321] = {kT0 + 54'321'000, 1000, 1000, 1000, 1};
  curve.points[54'322] = {kT0 + 54'322'000, NAN, NAN, NAN, 1};
  Thin(curve, kT0, kT0 + 100'000'000);
  EXPECT_LE(curve.points.size(), 2000U);
  EXPECT_GE(curve.points.size(), 1900U);
  EXPECT_EQ(curve.step_us, 50'001);
  double high = 0;
  for (const FleetCurvePoint& point : curve.points) {
    EXPECT_FALSE(std::isnan(point.value));
    EXPECT_EQ(point.low, 1);
    high = std::max(high, point.high);
  }
  EXPECT_EQ(high, 1000);
}

TEST(Thin, LeavesShortCurvesAndDoesNotJoinStreams) {
  FleetCurve few = {.points = {{kT0, 1, 1, 1, 1}, {kT0 + 1, 2, 2, 2, 1}}};
  Thin(few, kT0, kT0 + 2);
  EXPECT_EQ(few.points.size(), 2U);
  EXPECT_EQ(few.step_us, 0);
  FleetCurve two;
  for (int i = 0; i < 4000; ++i) two.points.push_back({kT0 + i, i < 2001 ? 1.0 : 9.0, 0, 0, i < 2001 ? 1 : 2});
  Thin(two, kT0, kT0 + 4000);
  for (const FleetCurvePoint& point : two.points) EXPECT_TRUE(point.value == 1 || point.value == 9) << point.value;
}

TEST(CurveFrame, HasAscendingTimesAndAGapBetweenStreams) {
  const FleetCurve curve = {
      .unit = "mm",
      .step_us = 10,
      .points = {{kT0 + 5, 1.5, 1, 2, 1}, {kT0 + 15, NAN, NAN, NAN, 1}, {kT0 + 15, 7, 6, 8, 2}}};
  const Json json = Json::parse(CurveFrame(kRequest, curve));
  EXPECT_EQ(json["type"], "fleet_curve");
  EXPECT_EQ(json["id"], 5);
  EXPECT_EQ(json["unit"], "mm");
  EXPECT_EQ(json["t0_utime"], kT0 + 5);
  EXPECT_EQ(json["dt_us"].dump(), "[0,10,11,12]");
  EXPECT_EQ(json["value"].dump(), "[1.5,null,null,7]");
  EXPECT_EQ(json["low"].dump(), "[1,null,null,6]");
  EXPECT_EQ(json["high"].dump(), "[2,null,null,8]");
}

TEST(CurveFrame, SamplesHaveNoBandAndACurveMayBeEmpty) {
  const Json samples = Json::parse(CurveFrame(kRequest, {.points = {{kT0, 1, 1, 1, 1}}}));
  EXPECT_FALSE(samples.contains("low"));
  const Json empty = Json::parse(CurveFrame(kRequest, {}));
  EXPECT_EQ(empty["dt_us"].dump(), "[]");
  EXPECT_EQ(empty["t0_utime"], kT0);
}

}  // namespace
}  // namespace axlecast
