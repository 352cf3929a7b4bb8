#include "tools/axlecast/logs/log_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

#include "tools/log/log_fixture.h"

namespace axlecast {
namespace {

constexpr std::int64_t kStart = 1'790'000'000'000'000;  // 2026-09-21 14:13:20 UTC
constexpr std::int64_t kEnd = kStart + 7'200'000'000;
constexpr LogSpan kSpan{.first = kStart, .last = kEnd};

TEST(LogTime, FromTheLogsStart) {
  EXPECT_EQ(ParseLogTime("0", kSpan), kStart);
  EXPECT_EQ(ParseLogTime("12.5", kSpan), kStart + 12'500'000);
  EXPECT_EQ(ParseLogTime("0.000001s", kSpan), kStart + 1);
  EXPECT_EQ(ParseLogTime("15m", kSpan), kStart + 900'000'000);
  EXPECT_EQ(ParseLogTime("1.5h", kSpan), kStart + 5'400'000'000);
  EXPECT_EQ(ParseLogTime("1d", kSpan), kStart + 86'400'000'000);
}

TEST(LogTime, BeforeItsEnd) {
  EXPECT_EQ(ParseLogTime("-10", kSpan), kEnd - 10'000'000);
  EXPECT_EQ(ParseLogTime("-0.5s", kSpan), kEnd - 500'000);
  EXPECT_EQ(ParseLogTime("-15m", kSpan), kEnd - 900'000'000);
  EXPECT_EQ(ParseLogTime("-0", kSpan), kEnd);
}

TEST(LogTime, InUtc) {
  EXPECT_EQ(ParseLogTime("1970-01-02", kSpan), 86'400'000'000);
  EXPECT_EQ(ParseLogTime("1970-01-01T00:00:05", kSpan), 5'000'000);
  EXPECT_EQ(ParseLogTime("1970-01-01T00:00:05.25", kSpan), 5'250'000);
  EXPECT_EQ(ParseLogTime("1970-01-01 00:00:05.123456789Z", kSpan), 5'123'456);
}

TEST(LogTime, NothingElse) {
  for (const char* text :
       {"", "x", "12.5x", "12 s", "-", "--1", "-x", "-2026-09-21", "1e3", "nan", "inf", "5w", "99999999999",
        "1970-01-32", "1970-01-01T00:00:05.", "1970-01-01T00:00:05.x", "1970-01-01T00:00:05.5.5", "s", "."}) {
    EXPECT_FALSE(ParseLogTime(text, kSpan)) << text;
  }
}

class LogTimeOptionsTest : public testing::Test {
 protected:
  std::string ErrorOf(std::vector<std::string> words) {
    options_ = {};
    CLI::App app;
    options_.AddTo(app);
    std::ranges::reverse(words);
    app.parse(std::move(words));
    const Result<> parsed = options_.Parse({log_.bytes()});
    return parsed ? "" : parsed.error().text;
  }

  const RecordedLog log_ = RecordedLog().Add(kStart, "a").Add(kEnd, "b");
  LogTimeOptions options_;
};

TEST_F(LogTimeOptionsTest, CountFromTheLogsEnds) {
  EXPECT_EQ(ErrorOf({}), "");
  EXPECT_FALSE(options_.from || options_.until);
  EXPECT_EQ(ErrorOf({"--from", "15m", "--until=-10"}), "");
  EXPECT_EQ(options_.from, kStart + 900'000'000);
  EXPECT_EQ(options_.until, kEnd - 10'000'000);
}

TEST_F(LogTimeOptionsTest, SayWhatIsWrong) {
  EXPECT_THAT(ErrorOf({"--from", "noon"}), testing::HasSubstr("'noon' is not a time: write 12.5"));
  EXPECT_THAT(ErrorOf({"--from", "2", "--until", "1"}), testing::HasSubstr("no event is between them"));
  EXPECT_THAT(ErrorOf({"--until", "2", "--from", "2"}), testing::HasSubstr("no event is between them"));
}

}  // namespace

}  // namespace axlecast
