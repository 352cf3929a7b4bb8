#include "core/base/utc_text.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

// `date -u -d '2026-11-21 07:00:05' +%s` prints 1795244405.
constexpr std::int64_t kThen = 1'795'244'405'000'000;

TEST(UtcText, IsOfTheCalendar) {
  EXPECT_EQ(UtcText(kThen), "2026-11-21 07:00:05");
  EXPECT_EQ(UtcText(0), "1970-01-01 00:00:00");
  EXPECT_EQ(UtcMillisecondText(kThen + 45'999), "2026-11-21 07:00:05.045");
  EXPECT_FALSE(UtcText(INT64_MAX).empty());
  EXPECT_FALSE(UtcMillisecondText(INT64_MIN).empty());
}

TEST(ParseUtc, TakesAgesAndDates) {
  EXPECT_EQ(ParseUtc("2h", kThen), kThen - 7'200'000'000);
  EXPECT_EQ(ParseUtc("3d", kThen), kThen - 259'200'000'000);
  EXPECT_EQ(ParseUtc("90s", kThen), kThen - 90'000'000);
  EXPECT_EQ(ParseUtc("15m", kThen), kThen - 900'000'000);
  EXPECT_EQ(ParseUtc("1w", kThen), kThen - 604'800'000'000);
  EXPECT_EQ(ParseUtc("2026-11-21T07:00:05Z", 0), kThen);
  EXPECT_EQ(ParseUtc("2026-11-21 07:00:05", 0), kThen);
  EXPECT_EQ(ParseUtc("2026-11-21T07:00", 0), kThen - 5'000'000);
  EXPECT_EQ(ParseUtc("2026-11-21", 0), 1'795'219'200'000'000);
  EXPECT_EQ(ParseUtc("1970-01-01Z", 0), 0);
}

TEST(ParseUtc, RefusesTheRest) {
  for (const char* text : {"", "2", "h", "-2h", "2x", "2h ", "99999999999999999999h", "yesterday", "2026",
                           "2026-11", "2026-13-01", "2026-02-30", "2026-11-21T", "2026-11-21T24:00",
                           "2026-11-21T07", "2026-11-21T07:00:", "2026-11-21T07:00:05+01:00", "2026-11-21T07:60"}) {
    EXPECT_FALSE(ParseUtc(text, kThen)) << text;
  }
}

}  // namespace
}  // namespace axlecast
