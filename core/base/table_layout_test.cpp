#include "core/base/table_layout.h"

#include <gtest/gtest.h>

#include <limits>

namespace axlecast {
namespace {

TEST(Columns, FillAndCut) {
  EXPECT_EQ(Left("ab", 4), "ab  ");
  EXPECT_EQ(Right("ab", 4), "  ab");
  EXPECT_EQ(Left("abcdef", 4), "abc\u2026");
  EXPECT_EQ(Right("abcdef", 4), "abc\u2026");
  EXPECT_EQ(Left("plug the adapter in", 14), "plug the\u2026     ") << "after a whole word, and filled up";
  EXPECT_EQ(Clip("abcdef", 6), "abcdef");
  EXPECT_EQ(Clip("abcdef", 0), "");
}

TEST(Columns, DecimalOfUnknownIsADash) {
  EXPECT_EQ(Decimal(1.25, 1), "1.2");
  EXPECT_EQ(Decimal(-0.5, 3), "-0.500");
  EXPECT_EQ(Decimal(std::numeric_limits<double>::quiet_NaN(), 1), "-");
  EXPECT_EQ(Decimal(std::numeric_limits<double>::infinity(), 1), "-");
  EXPECT_EQ(Decimal(1e300, 2), "1.00e+300");
}

TEST(Columns, PrintableKeepsTheMarkOfACutText) { EXPECT_EQ(Printable("cut\u2026"), "cut\u2026"); }

TEST(Columns, PrintableHasNoControlCharacters) { EXPECT_EQ(Printable("a\x1b[1m\n\xC3\xA9"), "a?[1m???"); }

}  // namespace
}  // namespace axlecast
