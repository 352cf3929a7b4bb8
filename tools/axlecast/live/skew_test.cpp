#include "tools/axlecast/live/skew.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace axlecast {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using OneAxis = position_set_axis_t;

OneAxis Reading(std::int8_t state, std::int32_t offset_us) {
  OneAxis axis{};
  axis.state = state;
  axis.offset_ns = offset_us * 1'000;
  axis.half_width_ns = 10'000;
  return axis;
}

position_set_t Set(std::int8_t state, std::int64_t hull_us, const OneAxis& x, const OneAxis& y) {
  position_set_t set{};
  set.state = state;
  set.earliest_ns = kSecond;
  set.latest_ns = kSecond + hull_us * 1'000;
  set.limit_ns = 100'000;
  set.axes = {x, y};
  set.n = 2;
  return set;
}

SkewStatistics FourTicks() {
  SkewStatistics skew({"x", "y"});
  const OneAxis on_time = Reading(OneAxis::STATE_GOOD, 0);
  skew.On(Set(position_set_t::STATE_ALIGNED, 50, on_time, Reading(OneAxis::STATE_GOOD, 20)));
  skew.On(Set(position_set_t::STATE_NOT_ALIGNED, 150, on_time, Reading(OneAxis::STATE_GOOD, -120)));
  skew.On(Set(position_set_t::STATE_INCOMPLETE, 20, on_time, Reading(OneAxis::STATE_MISSING, 0)));
  skew.On(Set(position_set_t::STATE_INCOMPLETE, 20, on_time, Reading(OneAxis::STATE_NOT_VALID, 0)));
  return skew;
}

TEST(Skew, CountsTicksByStateAndAxes) {
  const nlohmann::ordered_json json = FourTicks().ToJson();
  EXPECT_EQ(json["ticks"], 4);
  EXPECT_EQ(json["aligned"], 1);
  EXPECT_EQ(json["wider"], 1);
  EXPECT_EQ(json["incomplete"], 2);
  EXPECT_EQ(json["limit_us"], 100.0);
  EXPECT_EQ(json["hull_us"]["max"], 150.0) << "incomplete ticks have no hull of all axes";
  const auto& y = json["axes"][1];
  EXPECT_EQ(y["device"], "y");
  EXPECT_EQ(y["good"], 2);
  EXPECT_EQ(y["missing"], 1);
  EXPECT_EQ(y["not_valid"], 1);
  EXPECT_EQ(y["mean_from_tick_us"], -50.0);
  EXPECT_EQ(y["from_tick_us"]["max"], 120.0);
}

TEST(Skew, HasALineForEachAxis) {
  EXPECT_THAT(
      FourTicks().Lines(),
      ElementsAre(HasSubstr("4 ticks: 25.00 % aligned within 100.0 us, 25.00 % wider, 50.00 % incomplete"),
                  HasSubstr("max 150.0 us"), HasSubstr("MEAN FROM TICK"), HasSubstr("x "), HasSubstr("-50.0 us")));
}

TEST(Skew, WithoutTicksHasNoFigures) {
  const SkewStatistics skew({"x"});
  EXPECT_EQ(skew.ToJson()["hull_us"], nullptr);
  EXPECT_EQ(skew.ToJson()["axes"][0]["mean_from_tick_us"], nullptr);
  EXPECT_THAT(skew.Lines().back(), HasSubstr("-"));
}

}  // namespace
}  // namespace axlecast
