#include "tools/metrics/metrics_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace axlecast {
namespace {

using Type = Exposition::Type;

TEST(ExpositionTest, AFamilyIsItsHeaderAndItsSamples) {
  Exposition out;
  out.Family("axlecast_a_total", Type::kCounter, "What it counts.");
  out.Add({{"bus", "rs485-0"}, {"kind", "timeout"}}, std::int64_t{3});
  out.Add({}, 0.5);
  EXPECT_EQ(out.text(),
            "# HELP axlecast_a_total What it counts.\n"
            "# TYPE axlecast_a_total counter\n"
            "axlecast_a_total{bus=\"rs485-0\",kind=\"timeout\"} 3\n"
            "axlecast_a_total 0.5\n");
}

TEST(ExpositionTest, AFamilyWithoutSamplesLeavesNoTrace) {
  Exposition out;
  out.Family("axlecast_a", Type::kGauge, "Nothing.");
  out.Family("axlecast_b", Type::kHistogram, "One.");
  out.Add("_count", {}, std::int64_t{1});
  EXPECT_EQ(out.text(), "# HELP axlecast_b One.\n# TYPE axlecast_b histogram\naxlecast_b_count 1\n");
}

// Text format 0.0.4: label values escape backslash, double quote and line feed.
TEST(ExpositionTest, LabelValuesAreEscaped) {
  Exposition out;
  out.Family("a", Type::kGauge, "x");
  out.Add({{"l", "a\\b\"c\nd\xff"}}, std::int64_t{1});
  EXPECT_NE(out.text().find("a{l=\"a\\\\b\\\"c\\nd\xEF\xBF\xBD\"} 1\n"), std::string::npos) << out.text();
}

TEST(ExpositionTest, LabelValuesDoNotSteerTheTerminalOfWhoReadsThem) {
  Exposition out;
  out.Family("a", Type::kGauge, "x");
  out.Add({{"l", "\x1b[2J\r\xE2\x80\xAE"}}, std::int64_t{1});
  EXPECT_NE(out.text().find("a{l=\"\xEF\xBF\xBD[2J\xEF\xBF\xBD\xEF\xBF\xBD\"} 1\n"), std::string::npos)
      << out.text();
}

TEST(ExpositionTest, ASampleOccursOnce) {
  Exposition out;
  out.Family("a", Type::kGauge, "x");
  out.Add({{"l", "b"}}, std::int64_t{1});
  out.Add({{"l", "b"}}, std::int64_t{2});
  out.Family("c", Type::kGauge, "x");
  out.Add({{"l", "b"}}, std::int64_t{3});
  EXPECT_NE(out.text().find("a{l=\"b\"} 1\n"), std::string::npos);
  EXPECT_EQ(out.text().find(" 2\n"), std::string::npos);
  EXPECT_NE(out.text().find("c{l=\"b\"} 3\n"), std::string::npos);
}

TEST(MetricNumberTest, AreTheShortestThatReadBack) {
  EXPECT_EQ(MetricNumber(5e-05), "5e-05");
  EXPECT_EQ(MetricNumber(0.1), "0.1");
  EXPECT_EQ(MetricNumber(-12), "-12");
  EXPECT_EQ(MetricNumber(1e300), "1e+300");
  EXPECT_EQ(MetricNumber(std::nan("")), "NaN");
  EXPECT_EQ(MetricNumber(std::numeric_limits<double>::infinity()), "+Inf");
  EXPECT_EQ(MetricNumber(-std::numeric_limits<double>::infinity()), "-Inf");
}

}  // namespace
}  // namespace axlecast
