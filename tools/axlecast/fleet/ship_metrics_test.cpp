#include "tools/axlecast/fleet/ship_metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::HasSubstr;

TEST(ShipMetrics, EachNumberHasItsMetric) {
  const std::string text = ShipMetricsText(
      {.connected = true, .batches = 12, .holes = 3, .lag_bytes = 4'000'000'000, .lag_us = 1'250'000});
  EXPECT_THAT(text, HasSubstr("# TYPE axlecast_ship_lag_seconds gauge\naxlecast_ship_lag_seconds 1.25\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE axlecast_ship_lag_bytes gauge\naxlecast_ship_lag_bytes 4000000000\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE axlecast_ship_holes_total counter\naxlecast_ship_holes_total 3\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE axlecast_ship_database_up gauge\naxlecast_ship_database_up 1\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE axlecast_ship_batches_total counter\naxlecast_ship_batches_total 12\n"));
}

TEST(ShipMetrics, AShipperThatHasJustStartedHasAllOfThem) {
  const std::string text = ShipMetricsText({});
  for (const char* sample :
       {"lag_seconds 0\n", "lag_bytes 0\n", "holes_total 0\n", "database_up 0\n", "batches_total 0\n"}) {
    EXPECT_THAT(text, HasSubstr(std::string("\naxlecast_ship_") + sample));
  }
}

}  // namespace
}  // namespace axlecast
