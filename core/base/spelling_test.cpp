#include "core/base/spelling.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

TEST(ParseTime, KnowsItsUnits) {
  EXPECT_EQ(ParseTime("90s"), 90 * kSecond);
  EXPECT_EQ(ParseTime("15m"), 900 * kSecond);
  EXPECT_EQ(ParseTime("1.5h"), 5'400 * kSecond);
  EXPECT_EQ(ParseTime("14d"), 14 * 86'400 * kSecond);
  EXPECT_EQ(ParseTime("2w"), 14 * 86'400 * kSecond);
  EXPECT_EQ(ParseTime("4y"), 1'461 * 86'400 * kSecond) << "four years hold one leap day";
  EXPECT_EQ(ParseTime("0s"), 0);
}

TEST(ParseTime, RefusesWhatIsNone) {
  for (const char* text : {"", "14", "d", "14 d", "14D", "-1s", "1e3s", "14days", "201y", "nans", "infs", "1,5h"}) {
    EXPECT_FALSE(ParseTime(text)) << text;
  }
}

TEST(FormatTime, TakesTheLargestUnitThatLeavesNoFraction) {
  EXPECT_EQ(FormatTime(10 * kSecond), "10s");
  EXPECT_EQ(FormatTime(900 * kSecond), "15m");
  EXPECT_EQ(FormatTime(5'400 * kSecond), "90m");
  EXPECT_EQ(FormatTime(kSecond / 10), "0.1s");
  EXPECT_EQ(FormatTime(*ParseTime("5y")), "5y");
}

TEST(ParseSize, CountsInPowersOf1024) {
  EXPECT_EQ(ParseSize("1kB"), 1'024);
  EXPECT_EQ(ParseSize("1.5MB"), 3 << 19);
  EXPECT_EQ(ParseSize("20GB"), std::int64_t{20} << 30);
  EXPECT_EQ(ParseSize("1TB"), std::int64_t{1} << 40);
}

TEST(ParseSize, RefusesWhatIsNone) {
  for (const char* text : {"", "100", "MB", "100 MB", "100M", "-1MB", "1e3MB", "1025TB", "nanMB"}) {
    EXPECT_FALSE(ParseSize(text)) << text;
  }
}

TEST(FormatSize, TakesTheLargestUnitThatLeavesNoFraction) {
  EXPECT_EQ(FormatSize(16 << 20), "16MB");
  EXPECT_EQ(FormatSize(3 << 19), "1536kB");
  EXPECT_EQ(FormatSize(std::int64_t{20} << 30), "20GB");
}

}  // namespace

}  // namespace axlecast
