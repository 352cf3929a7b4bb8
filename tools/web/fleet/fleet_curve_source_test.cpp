#include "tools/web/fleet/fleet_curve_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using Table = CurveSource::Table;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kHourUs = 3600 * kSecondUs;
constexpr std::int64_t kStart = 1'790'000'000 * kSecondUs;

const CurveColumn kValue = *FindCurveColumn("value");
const CurveColumn kPower = *FindCurveColumn("power_w");

std::vector<CurveSource> SourcesOf(const CurveColumn& column, std::int64_t span) {
  return CurveSourcesOf(column, kStart, kStart + span);
}

TEST(CurveSourcesOf, TakesSamplesSecondsOrMinutesByTheLengthOfTheTime) {
  EXPECT_THAT(SourcesOf(kValue, 10 * kSecondUs),
              ElementsAre(CurveSource{Table::kSamples, 0}, CurveSource{Table::kSeconds, kSecondUs},
                          CurveSource{Table::kMinutes, 60 * kSecondUs}));
  EXPECT_THAT(SourcesOf(kValue, 61 * kSecondUs),
              ElementsAre(CurveSource{Table::kSeconds, kSecondUs}, CurveSource{Table::kMinutes, 60 * kSecondUs}));
  EXPECT_THAT(SourcesOf(kValue, kHourUs), ElementsAre(CurveSource{Table::kSeconds, 2 * kSecondUs},
                                                      CurveSource{Table::kMinutes, 60 * kSecondUs}));
  EXPECT_THAT(SourcesOf(kValue, 24 * kHourUs), ElementsAre(CurveSource{Table::kMinutes, 60 * kSecondUs}));
  EXPECT_THAT(SourcesOf(kValue, 30 * 24 * kHourUs), ElementsAre(CurveSource{Table::kMinutes, 1800 * kSecondUs}));
}

TEST(CurveSourcesOf, TakesReadingsOfAMotorOrIntervalsOfThem) {
  EXPECT_THAT(SourcesOf(kPower, 60 * kSecondUs), ElementsAre(CurveSource{Table::kMotor, 0}));
  EXPECT_THAT(SourcesOf(kPower, kHourUs), ElementsAre(CurveSource{Table::kMotor, 2 * kSecondUs}));
}

TEST(CurveSourcesOf, NoTimeHasMorePointsThanACurveMayHave) {
  for (std::int64_t span = 1; span <= kMaxFleetSpan; span += span / 7 + 1) {
    for (const CurveColumn& column : {kValue, kPower}) {
      const std::vector<CurveSource> sources = SourcesOf(column, span);
      ASSERT_FALSE(sources.empty()) << span;
      for (const CurveSource source : sources) {
        if (source.step_us == 0) continue;
        ASSERT_LE(span / source.step_us, kMaxCurvePoints) << span;
      }
      ASSERT_TRUE(sources.back().step_us > 0 || span <= 600 * kSecondUs) << span;
    }
  }
}

TEST(CurveSql, BindsWhatABrowserSends) {
  for (const Table table : {Table::kSamples, Table::kSeconds, Table::kMinutes}) {
    const std::string sql = CurveSql({table, table == Table::kSamples ? 0 : kSecondUs}, kValue);
    for (const char* parameter : {"$1", "$2", "$3", "$4", "$5", "$6", "LIMIT"})
      EXPECT_THAT(sql, HasSubstr(parameter));
    EXPECT_THAT(sql, Not(HasSubstr("@")));
  }
  EXPECT_THAT(CurveSql({Table::kSeconds, kSecondUs}, kValue), HasSubstr("axlecast.position_second"));
  EXPECT_THAT(CurveSql({Table::kMinutes, kSecondUs}, kValue), HasSubstr("axlecast.position_minute"));
  EXPECT_THAT(CurveSql({Table::kMotor, kSecondUs}, kPower), HasSubstr("max(power_w)"));
  EXPECT_THAT(CurveSql({Table::kMotor, 0}, kPower), HasSubstr("SELECT t, power_w"));
}

}  // namespace
}  // namespace axlecast
