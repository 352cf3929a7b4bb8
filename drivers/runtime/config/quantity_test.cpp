#include "drivers/runtime/config/quantity.h"

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

TEST(TimeText, TakesTheLargestUnitThatLeavesNoFraction) {
  EXPECT_EQ(TimeText(10 * kSecond), "10s");
  EXPECT_EQ(TimeText(900 * kSecond), "15m");
  EXPECT_EQ(TimeText(5'400 * kSecond), "90m");
  EXPECT_EQ(TimeText(kSecond / 10), "0.1s");
  EXPECT_EQ(TimeText(*ParseTime("5y")), "5y");
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

TEST(SizeText, TakesTheLargestUnitThatLeavesNoFraction) {
  EXPECT_EQ(SizeText(16 << 20), "16MB");
  EXPECT_EQ(SizeText(3 << 19), "1536kB");
  EXPECT_EQ(SizeText(std::int64_t{20} << 30), "20GB");
}

}  // namespace
}  // namespace axlecast
