#include "drivers/saa/data_sheet.h"

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/saa/table_test_support.h"

namespace axlecast::saa {
namespace {

// 4.1, every column.
TEST(SaaDataSheet, TheWholeTableOfAccuracies) {
  for (const TableColumn& column : kTable41) {
    EXPECT_EQ(AccuracyArcSeconds(column.bits), column.accuracy) << column.bits;
    EXPECT_EQ(NoiseCounts(column.bits), column.noise) << column.bits;
  }
}

// "11-15 bit" has no accuracy in the table; nor have 10 bits.
TEST(SaaDataSheet, BelowSixteenBitsThereIsNone) {
  for (int bits = kMinBits; bits < 16; ++bits) {
    EXPECT_FALSE(AccuracyArcSeconds(bits)) << bits;
    EXPECT_EQ(NoiseCounts(bits), 1) << bits;
  }
}

// Encoders of other makers have up to 32 bits where a family takes them.
TEST(SaaDataSheet, AboveTheSeriesTheBestAccuracyHolds) {
  EXPECT_EQ(AccuracyArcSeconds(32), 5);
  EXPECT_EQ(NoiseCounts(32), 33'141);
}

// Two readings of one place that differ by more than the bound cannot both be as accurate as the table states.
TEST(SaaDataSheet, TheBoundIsTheSmallestThatHoldsTwiceTheAccuracy) {
  for (const TableColumn& column : kTable41) {
    const double count = 360.0 * 3'600 / std::ldexp(1.0, column.bits);
    EXPECT_GE(static_cast<double>(NoiseCounts(column.bits)) * count, 2.0 * column.accuracy) << column.bits;
    EXPECT_LT(static_cast<double>(NoiseCounts(column.bits) - 1) * count, 2.0 * column.accuracy) << column.bits;
  }
}

// Chapter 3, 4.1 and 4.2.
TEST(SaaDataSheet, ModelsResolutionsAndSpeed) {
  EXPECT_EQ(kMinBits, 10);
  EXPECT_EQ(kMaxBits, 26);
  EXPECT_EQ(kMaxSpeedRpm, 5'000);
  EXPECT_EQ(kModels.size(), 1U + 6) << "3.1 to 3.6, and any";
}

}  // namespace
}  // namespace axlecast::saa
