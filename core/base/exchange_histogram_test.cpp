#include "core/base/exchange_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace axlecast {
namespace {

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
