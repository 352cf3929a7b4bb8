#include "tools/mqtt/sparkplug/metric_table.h"

#include <gtest/gtest.h>

#include <set>

namespace axlecast {
namespace {

MetricReading Count(std::int32_t value) { return {"Count", SparkplugType::kInt32, value}; }
MetricReading Length(double value, const std::string& unit = "mm", std::int32_t quality = kQualityGood) {
  MetricReading reading{"Length", SparkplugType::kDouble, value};
  reading.properties = {{"engUnit", SparkplugType::kString, unit}};
  reading.quality = quality;
  return reading;
}

class MetricTableTest : public ::testing::Test {
 protected:
  MetricTableTest() {
    table_.Define({"Count", SparkplugType::kInt32});
    table_.Define(Length(0));
  }

  std::uint64_t next_alias_ = 1;
  MetricTable table_{next_alias_};
};

TEST_F(MetricTableTest, ABirthHasEveryMetricAlsoWithoutAValue) {
  MetricTable table(next_alias_);
  table.Define({"Unknown", SparkplugType::kInt32});
  const auto birth = table.Birth(70);
  ASSERT_EQ(birth.size(), 1U);
  EXPECT_EQ(birth[0].name, "Unknown");
  EXPECT_EQ(birth[0].alias, 3U);
  EXPECT_EQ(birth[0].timestamp_ms, 70);
  EXPECT_EQ(birth[0].value, SparkplugValue());
}

TEST_F(MetricTableTest, AliasesAreUniqueOverTablesAndNeverChange) {
  MetricTable other(next_alias_);
  other.Define({"Count", SparkplugType::kInt32});
  std::set<std::uint64_t> aliases;
  for (const MetricTable* table : {&table_, &other}) {
    for (const SparkplugMetric& metric : table->Birth(0)) aliases.insert(metric.alias.value());
  }
  EXPECT_EQ(aliases.size(), 3U);
  const auto before = table_.Birth(0);
  static_cast<void>(table_.Apply({Count(1), {"New", SparkplugType::kInt32, 1}}, 10));
  const auto after = table_.Birth(0);
  for (const SparkplugMetric& metric : before) {
    const auto same =
        std::find_if(after.begin(), after.end(), [&](const auto& each) { return each.name == metric.name; });
    ASSERT_NE(same, after.end());
    EXPECT_EQ(same->alias, metric.alias);
  }
}

TEST_F(MetricTableTest, OnlyChangesAreReturnedByAliasWithTheirType) {
  const auto first = table_.Apply({Count(1), Length(2)}, 10);
  EXPECT_FALSE(first.needs_birth);
  ASSERT_EQ(first.metrics.size(), 2U);
  EXPECT_EQ(first.metrics[0].name, "");
  EXPECT_EQ(first.metrics[0].alias, 1U);
  EXPECT_EQ(first.metrics[0].type, SparkplugType::kInt32);
  const auto second = table_.Apply({Count(1), Length(3)}, 20);
  ASSERT_EQ(second.metrics.size(), 1U);
  EXPECT_EQ(second.metrics[0].alias, 2U);
  EXPECT_EQ(second.metrics[0].timestamp_ms, 20);
  ASSERT_EQ(second.metrics[0].properties.size(), 1U) << "the unit is in the birth only";
  EXPECT_EQ(second.metrics[0].properties[0].key, "Quality");
  EXPECT_TRUE(table_.Apply({Count(1), Length(3)}, 30).metrics.empty());
}

TEST_F(MetricTableTest, ANullValueIsAChangeOnce) {
  static_cast<void>(table_.Apply({Count(1)}, 10));
  EXPECT_EQ(table_.Apply({{"Count", SparkplugType::kInt32}}, 20).metrics.size(), 1U);
  EXPECT_EQ(table_.Apply({{"Count", SparkplugType::kInt32}}, 30).metrics.size(), 0U);
}

TEST_F(MetricTableTest, ANewMetricAnotherTypeOrUnitNeedsABirth) {
  static_cast<void>(table_.Apply({Count(1), Length(2)}, 10));
  EXPECT_TRUE(table_.Apply({Length(2, "m")}, 20).needs_birth);
  EXPECT_FALSE(table_.Apply({Length(2, "m")}, 30).needs_birth);
  EXPECT_TRUE(table_.Apply({{"New", SparkplugType::kBoolean, true}}, 40).needs_birth);
  EXPECT_TRUE(table_.Apply({{"Count", SparkplugType::kInt64, std::int64_t{1}}}, 50).needs_birth);
}

TEST_F(MetricTableTest, WhatIsOnlyInBirthsNeedsABirthWhenItChanges) {
  MetricReading boot{"BootId", SparkplugType::kString, std::string("a")};
  boot.only_in_births = true;
  table_.Define({.name = "BootId", .type = SparkplugType::kString, .only_in_births = true});
  EXPECT_TRUE(table_.Apply({boot}, 10).needs_birth);
  const auto same = table_.Apply({boot}, 20);
  EXPECT_FALSE(same.needs_birth);
  EXPECT_TRUE(same.metrics.empty());
  boot.value = std::string("b");
  EXPECT_TRUE(table_.Apply({boot}, 30).needs_birth);
  EXPECT_TRUE(table_.Historical({boot}, 5).metrics.empty());
}

TEST_F(MetricTableTest, AnEventIsSentEachTimeAndNotInBirths) {
  MetricReading event{"Event", SparkplugType::kString, std::string("{}")};
  event.is_transient = true;
  static_cast<void>(table_.Apply({event}, 10));
  const auto again = table_.Apply({event}, 20);
  ASSERT_EQ(again.metrics.size(), 1U);
  EXPECT_TRUE(again.metrics[0].is_transient);
  for (const SparkplugMetric& metric : table_.Birth(30)) {
    if (metric.name == "Event") {
      EXPECT_EQ(metric.value, SparkplugValue());
    }
  }
}

TEST_F(MetricTableTest, QualityIsGoodBadOrStale) {
  static_cast<void>(table_.Apply({Count(1), Length(2)}, 10));
  const auto bad = table_.Apply({Length(2, "mm", kQualityBad)}, 20);
  ASSERT_EQ(bad.metrics.size(), 1U);
  EXPECT_EQ(bad.metrics[0].properties[0].value, SparkplugValue(kQualityBad));
  const auto stale = table_.MarkStale(30);
  ASSERT_EQ(stale.size(), 1U) << "Count has no quality";
  EXPECT_EQ(stale[0].properties[0].value, SparkplugValue(kQualityStale));
  EXPECT_EQ(stale[0].properties[0].type, SparkplugType::kInt32);
  EXPECT_TRUE(table_.MarkStale(40).empty());
}

TEST_F(MetricTableTest, ABirthIsInTheOrderOfTime) {
  static_cast<void>(table_.Apply({Count(1)}, 20));
  static_cast<void>(table_.Apply({Length(2)}, 10));
  const auto birth = table_.Birth(99);
  EXPECT_EQ(birth[0].name, "Length");
  EXPECT_EQ(birth[1].name, "Count");
}

TEST_F(MetricTableTest, HistoricalValuesChangeNoCurrentOnes) {
  static_cast<void>(table_.Apply({Count(1)}, 10));
  const auto old = table_.Historical({Count(0)}, 5);
  EXPECT_FALSE(old.needs_birth);
  ASSERT_EQ(old.metrics.size(), 1U);
  EXPECT_TRUE(old.metrics[0].is_historical);
  EXPECT_EQ(old.metrics[0].timestamp_ms, 5);
  EXPECT_TRUE(table_.Apply({Count(1)}, 20).metrics.empty());
  EXPECT_TRUE(table_.Historical({{"New", SparkplugType::kInt32, 1}}, 5).needs_birth);
}

}  // namespace
}  // namespace axlecast
