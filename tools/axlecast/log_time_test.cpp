#include "tools/axlecast/log_time.h"

#include <gtest/gtest.h>

namespace axlecast {
namespace {

constexpr std::int64_t kStart = 1'790'000'000'000'000;

TEST(LogTime, FromTheLogsStart) {
  EXPECT_EQ(ParseLogTime("0", kStart), kStart);
  EXPECT_EQ(ParseLogTime("12.5", kStart), kStart + 12'500'000);
  EXPECT_EQ(ParseLogTime("0.000001s", kStart), kStart + 1);
  EXPECT_EQ(ParseLogTime("15m", kStart), kStart + 900'000'000);
  EXPECT_EQ(ParseLogTime("1.5h", kStart), kStart + 5'400'000'000);
  EXPECT_EQ(ParseLogTime("1d", kStart), kStart + 86'400'000'000);
}

TEST(LogTime, InUtc) {
  EXPECT_EQ(ParseLogTime("1970-01-02", kStart), 86'400'000'000);
  EXPECT_EQ(ParseLogTime("1970-01-01T00:00:05", kStart), 5'000'000);
  EXPECT_EQ(ParseLogTime("1970-01-01T00:00:05.25", kStart), 5'250'000);
  EXPECT_EQ(ParseLogTime("1970-01-01 00:00:05.123456789Z", kStart), 5'123'456);
}

TEST(LogTime, NothingElse) {
  for (const char* text : {"", "x", "12.5x", "12 s", "-1", "1e3", "nan", "inf", "5w", "99999999999", "1970-01-32",
                           "1970-01-01T00:00:05.", "1970-01-01T00:00:05.x", "1970-01-01T00:00:05.5.5", "s", "."}) {
    EXPECT_FALSE(ParseLogTime(text, kStart)) << text;
  }
}

}  // namespace
}  // namespace axlecast
