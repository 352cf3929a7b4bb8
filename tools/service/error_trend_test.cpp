#include "tools/service/error_trend.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

constexpr std::int64_t kHour = 3'600'000'000;
constexpr std::int64_t kStart = 472'222 * kHour;

bus_health_t Health(std::int64_t utime, std::int64_t boot, std::int64_t seq, std::int64_t exchanges,
                    std::int64_t timeouts) {
  bus_health_t health{};
  health.utime = utime;
  health.boot_id = boot;
  health.seq = seq;
  health.bus = "rs485-0";
  health.port = "/dev/ttyUSB0";
  health.exchanges = exchanges;
  health.errors[0] = timeouts;
  return health;
}

TEST(ErrorTrend, CountsByHours) {
  ErrorTrend trend;
  trend.OnBus(Health(kStart + 10, 1, 0, 100, 1));
  trend.OnBus(Health(kStart + kHour - 1, 1, 1, 1'000, 3));
  trend.OnBus(Health(kStart + kHour, 1, 2, 1'500, 3));
  const auto& bus = trend.buses().at("rs485-0");
  ASSERT_EQ(bus.entries.size(), 2U);
  EXPECT_EQ(bus.entries.at(kStart).exchanges, 1'000);
  EXPECT_EQ(bus.entries.at(kStart).Failed(), 3);
  EXPECT_EQ(bus.entries.at(kStart + kHour).exchanges, 500);
  EXPECT_EQ(bus.entries.at(kStart + kHour).Failed(), 0);
  EXPECT_EQ(bus.port, "/dev/ttyUSB0");
}

TEST(ErrorTrend, ADriverThatStartsAnewCountsFromItsZero) {
  ErrorTrend trend;
  trend.OnBus(Health(kStart, 1, 0, 1'000, 5));
  trend.OnBus(Health(kStart + 1, 2, 0, 10, 1));
  trend.OnBus(Health(kStart + 2, 2, 1, 20, 1));
  const auto& entry = trend.buses().at("rs485-0").entries.at(kStart);
  EXPECT_EQ(entry.exchanges, 1'020);
  EXPECT_EQ(entry.Failed(), 6);
}

TEST(ErrorTrend, CountersOfADamagedMessageStayNumbers) {
  ErrorTrend trend;
  std::int64_t boot = 0;
  for (const std::int64_t counts : {INT64_MIN, INT64_MAX, std::int64_t{-1}, INT64_MAX, INT64_MAX}) {
    trend.OnBus(Health(kStart, ++boot, 0, counts, counts));
  }
  EXPECT_EQ(trend.buses().at("rs485-0").entries.at(kStart).exchanges, std::int64_t{1} << 50);
}

TEST(ErrorTrend, WhatIsToldTwiceCountsOnce) {
  ErrorTrend trend;
  for (int i = 0; i < 3; ++i) trend.OnBus(Health(kStart, 1, 7, 1'000, 5));
  trend.OnBus(Health(kStart, 1, 6, 900, 4));
  EXPECT_EQ(trend.buses().at("rs485-0").entries.at(kStart).exchanges, 1'000);
}

TEST(ErrorTrend, IsBounded) {
  ErrorTrend trend;
  for (int i = 0; i < 1'000; ++i) {
    bus_health_t health = Health(kStart + i * kHour, 1, i, i, 0);
    health.bus = "bus" + std::to_string(i);
    trend.OnBus(health);
  }
  EXPECT_EQ(trend.buses().size(), 64U);
  for (int i = 0; i < 5'000; ++i) trend.OnBus(Health(kStart + i * kHour, 2, i, i, 0));
  bus_health_t known = Health(kStart, 3, 0, 0, 0);
  known.bus = "bus0";
  for (int i = 0; i < 5'000; ++i) {
    known.utime = kStart + i * kHour;
    known.seq = i;
    trend.OnBus(known);
  }
  EXPECT_EQ(trend.buses().at("bus0").entries.size(), 24U * 92U);
}

TEST(KindsText, NamesKinds) {
  EXPECT_EQ(KindsText({}), "none");
  EXPECT_EQ(KindsText({3, 0, 0, 1}), "timeout 3, checksum 1");
}

}  // namespace

}  // namespace axlecast
