#include "tools/convert/curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace axlecast {
namespace {

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
