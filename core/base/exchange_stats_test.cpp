#include "core/base/exchange_stats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace axlecast {
namespace {

TEST(ExchangeStatsTest, EmptyWindow) {
  const ExchangeStats stats;
  EXPECT_EQ(stats.count(), 0);
  EXPECT_EQ(stats.min(), 0);
  EXPECT_EQ(stats.max(), 0);
  EXPECT_EQ(stats.Percentile(0.5), 0);
}

TEST(ExchangeStatsTest, OneValueIsEveryPercentileExactly) {
  ExchangeStats stats;
  stats.Add(51'234);
  EXPECT_EQ(stats.min(), 51'234);
  EXPECT_EQ(stats.Percentile(0.01), 51'234);
  EXPECT_EQ(stats.Percentile(0.99), 51'234);
  EXPECT_EQ(stats.max(), 51'234);
}

// Against the definition of a percentile over the sorted values.
TEST(ExchangeStatsTest, PercentilesOfALogNormalAreWithinOnePercent) {
  std::mt19937_64 random(1);
  std::lognormal_distribution<double> durations(std::log(30'000.0), 1.5);
  ExchangeStats stats;
  std::vector<MonoNs> sorted;
  for (int i = 0; i < 100'000; ++i) {
    sorted.push_back(static_cast<MonoNs>(durations(random)));
    stats.Add(sorted.back());
  }
  std::sort(sorted.begin(), sorted.end());
  for (const double q : {0.001, 0.1, 0.5, 0.9, 0.99, 0.999, 1.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(q * static_cast<double>(sorted.size())));
    const auto exact = static_cast<double>(sorted[rank - 1]);
    EXPECT_NEAR(static_cast<double>(stats.Percentile(q)), exact, 0.008 * exact) << q;
  }
  EXPECT_EQ(stats.min(), sorted.front());
  EXPECT_EQ(stats.max(), sorted.back());
}

TEST(ExchangeStatsTest, EveryMagnitudeIsWithinHalfABucket) {
  for (MonoNs duration = 1; duration < 100 * kSecond; duration += duration / 7 + 1) {
    ExchangeStats stats;
    stats.Add(0);
    stats.Add(duration);
    stats.Add(2 * duration);
    EXPECT_NEAR(static_cast<double>(stats.Percentile(0.6)), static_cast<double>(duration),
                static_cast<double>(duration) / 128)
        << duration;
  }
}

TEST(ExchangeStatsTest, ClearsForTheNextWindow) {
  ExchangeStats stats;
  stats.Add(5);
  stats.Clear();
  stats.Add(kSecond);
  EXPECT_EQ(stats.count(), 1);
  EXPECT_EQ(stats.min(), kSecond);
}

TEST(ExchangeStatsTest, OutOfRangeDurationsAreKept) {
  ExchangeStats stats;
  stats.Add(-5);
  stats.Add(kNever);
  EXPECT_EQ(stats.min(), 0);
  EXPECT_EQ(stats.max(), kNever);
  EXPECT_EQ(stats.count(), 2);
}

constexpr auto kBounds = ExchangeHistogram::kBoundsUs;

TEST(ExchangeHistogramTest, BoundsRise) { EXPECT_TRUE(std::is_sorted(kBounds.begin(), kBounds.end())); }

TEST(ExchangeHistogramTest, ABoundIsWithinItsBucketAndTheNextNanosecondIsNot) {
  for (std::size_t i = 0; i < kBounds.size(); ++i) {
    ExchangeHistogram times;
    times.Add(kBounds[i] * kMicrosecond);
    times.Add(kBounds[i] * kMicrosecond + 1);
    EXPECT_EQ(times.Within()[i], 1) << kBounds[i];
    EXPECT_EQ(i == 0 ? 0 : times.Within()[i - 1], 0) << kBounds[i];
    EXPECT_EQ(times.total(), 2);
  }
}

TEST(ExchangeHistogramTest, CountsAreCumulativeAndOnlyGrow) {
  ExchangeHistogram times;
  times.Add(60 * kMicrosecond);
  times.Add(60 * kMicrosecond);
  times.Add(4 * kMillisecond);
  const auto before = times.Within();
  EXPECT_EQ(before[2], 0);  // 50 us
  EXPECT_EQ(before[3], 2);  // 75 us
  EXPECT_EQ(before.back(), 3);
  times.Add(0);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(times.Within()[i], before[i] + 1);
  EXPECT_EQ(times.sum(), 2 * 60 * kMicrosecond + 4 * kMillisecond);
}

TEST(ExchangeHistogramTest, WhatIsBeyondTheLastBoundIsInTheTotalAlone) {
  ExchangeHistogram times;
  times.Add(2 * kSecond);
  times.Add(-1);
  EXPECT_EQ(times.total(), 2);
  EXPECT_EQ(times.Within().back(), 1);
  EXPECT_EQ(times.sum(), 2 * kSecond);
}

}  // namespace

}  // namespace axlecast
