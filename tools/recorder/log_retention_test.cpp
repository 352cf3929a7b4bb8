#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "tools/log/log_name.h"
#include "tools/recorder/log_retention.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::int64_t kSecondUs = 1'000'000;
constexpr std::int64_t kNow = 1'795'244'405 * kSecondUs;  // date -u -d @1795244405: 2026-11-21 07:00:05

class ExpiredLogsTest : public ::testing::Test {
 protected:
  // Begun so many hours ago.
  void Add(int hours, std::int64_t bytes) { logs_.push_back({Name(hours), bytes}); }
  [[nodiscard]] static std::string Name(int hours) { return LogFileName("m", kNow - hours * 3'600 * kSecondUs, 0); }
  [[nodiscard]] std::vector<std::string> Expired(const Retention& retention, const std::string& current) const {
    return FilesOf(FindExpired(logs_, "m", current, retention, kNow).expired);
  }

  [[nodiscard]] std::vector<std::string> Held(const Retention& retention, const std::string& current) const {
    return FilesOf(FindExpired(logs_, "m", current, retention, kNow).held);
  }
  [[nodiscard]] static std::vector<std::string> FilesOf(const std::vector<StoredLog>& logs) {
    std::vector<std::string> files;
    for (const StoredLog& log : logs) files.push_back(log.file);
    return files;
  }

  std::vector<StoredLog> logs_;
};

TEST_F(ExpiredLogsTest, TheOldestGoUntilTheRestFits) {
  Add(1, 50);
  Add(3, 50);
  Add(2, 50);
  logs_.push_back({"precious.lcm", 1'000'000});
  EXPECT_THAT(Expired({.quota_bytes = 150}, Name(1)), IsEmpty());
  EXPECT_THAT(Expired({.quota_bytes = 149}, Name(1)), ElementsAre(Name(3)));
  EXPECT_THAT(Expired({.quota_bytes = 60}, Name(1)), ElementsAre(Name(3), Name(2)));
  EXPECT_THAT(Expired({.quota_bytes = 1}, Name(1)), ElementsAre(Name(3), Name(2))) << "never the current one";
  EXPECT_THAT(Expired({}, Name(1)), IsEmpty());
}

TEST_F(ExpiredLogsTest, LogsOfOneSecondGoInTheirOrder) {
  for (const int copy : {1'000, 999, 2, 0}) logs_.push_back({LogFileName("m", kNow, copy), 10});
  EXPECT_THAT(Expired({.quota_bytes = 10}, ""),
              ElementsAre(LogFileName("m", kNow, 0), LogFileName("m", kNow, 2), LogFileName("m", kNow, 999)));
}

TEST_F(ExpiredLogsTest, ALogGoesWhenItsLastMessageIsTooOld) {
  Add(30, 1);
  Add(20, 1);
  Add(10, 1);
  const Retention day{.keep_us = 15 * 3'600 * kSecondUs};
  EXPECT_THAT(Expired(day, Name(10)), ElementsAre(Name(30))) << "that of 20 hours ago ended 10 hours ago";
  EXPECT_THAT(Expired({.keep_us = kSecondUs}, "elsewhere"), ElementsAre(Name(30), Name(20)))
      << "when the newest ended is not known";
}

TEST_F(ExpiredLogsTest, ALogIsKeptForTheWholeTime) {
  Add(30, 1);
  Add(16, 1);
  Add(15, 1);
  Add(1, 1);
  const std::int64_t hours = 3'600 * kSecondUs;
  EXPECT_THAT(Expired({.keep_us = 15 * hours}, ""), ElementsAre(Name(30))) << "the next one ended 15 hours ago";
  EXPECT_THAT(Expired({.keep_us = 15 * hours - 1}, ""), ElementsAre(Name(30), Name(16)));
  logs_[2].last_utime = kNow - 15 * hours;
  EXPECT_THAT(Expired({.keep_us = 15 * hours}, ""), ElementsAre(Name(30)));
}

TEST_F(ExpiredLogsTest, TheCurrentLogIsKeptAlsoIfItIsTheOldest) {
  for (const int hours : {3, 2, 1}) Add(hours, 50);
  EXPECT_THAT(Expired({.quota_bytes = 1}, Name(3)), ElementsAre(Name(2)));
  EXPECT_THAT(Expired({.keep_us = 1}, Name(3)), ElementsAre(Name(2)));
}

TEST_F(ExpiredLogsTest, TheNewestLogIsKeptWhateverTheQuota) {
  for (const int hours : {3, 2, 1}) Add(hours, 50);
  EXPECT_THAT(Expired({.quota_bytes = 1}, ""), ElementsAre(Name(3), Name(2)));
}

TEST_F(ExpiredLogsTest, WhatIsTooOldCountsAgainstTheQuotaNoMore) {
  Add(30, 50);
  Add(20, 50);
  Add(1, 50);
  logs_[1].last_utime = kNow - 25 * 3'600 * kSecondUs;
  EXPECT_THAT(Expired({.quota_bytes = 100, .keep_us = 24 * 3'600 * kSecondUs}, Name(1)),
              ElementsAre(Name(30), Name(20)));
  EXPECT_THAT(Expired({.quota_bytes = 100, .keep_us = 26 * 3'600 * kSecondUs}, Name(1)), ElementsAre(Name(30)));
}

TEST_F(ExpiredLogsTest, ItsLastMessageDecidesWhereItIsKnown) {
  Add(30, 1);
  Add(20, 1);
  logs_[0].last_utime = kNow - 14 * 3'600 * kSecondUs;
  logs_[1].last_utime = kNow - 16 * 3'600 * kSecondUs;
  Add(5, 1);
  Add(4, 1);
  logs_[2].last_utime = 1;  // its clock began in 1970
  EXPECT_THAT(Expired({.keep_us = 15 * 3'600 * kSecondUs}, "elsewhere"), ElementsAre(Name(20), Name(5)))
      << "the recorder stood still, and its clock had been set";
}

TEST_F(ExpiredLogsTest, LogsThatAreNotShippedAreHeld) {
  for (const int hours : {5, 4, 3, 2, 1}) Add(hours, 50);
  const Retention retention{.quota_bytes = 150, .needs_shipping = true};
  EXPECT_THAT(Expired(retention, Name(1)), IsEmpty());
  EXPECT_THAT(Held(retention, Name(1)), ElementsAre(Name(5), Name(4), Name(3), Name(2)));
  logs_[0].shipped = true;
  EXPECT_THAT(Expired(retention, Name(1)), ElementsAre(Name(5)));
  EXPECT_THAT(Held(retention, Name(1)), ElementsAre(Name(4), Name(3), Name(2)));
  logs_[1].shipped = true;
  EXPECT_THAT(Expired(retention, Name(1)), ElementsAre(Name(5), Name(4)));
  EXPECT_THAT(Held(retention, Name(1)), IsEmpty()) << "the quota is kept";
}

TEST_F(ExpiredLogsTest, NewerLogsThatAreShippedGoInPlaceOfHeldOnes) {
  for (const int hours : {5, 4, 3, 2, 1}) Add(hours, 50);
  for (const std::size_t shipped : {2U, 3U, 4U}) logs_[shipped].shipped = true;
  const Retention retention{.quota_bytes = 150, .needs_shipping = true};
  EXPECT_THAT(Expired(retention, ""), ElementsAre(Name(3), Name(2)));
  EXPECT_THAT(Held(retention, ""), ElementsAre(Name(5), Name(4)));
}

TEST_F(ExpiredLogsTest, AnOldLogIsHeldAsWell) {
  Add(30, 1);
  Add(20, 1);
  Add(1, 1);
  const Retention retention{.keep_us = 15 * 3'600 * kSecondUs, .needs_shipping = true};
  EXPECT_THAT(Held(retention, Name(1)), ElementsAre(Name(30)));
  EXPECT_THAT(Expired(retention, Name(1)), IsEmpty());
  logs_[0].shipped = true;
  EXPECT_THAT(Expired(retention, Name(1)), ElementsAre(Name(30)));
  EXPECT_THAT(Held({.keep_us = 15 * 3'600 * kSecondUs}, Name(1)), IsEmpty()) << "nobody ships";
}

TEST(IsNearlyFull, BelowTheGreaterReserve) {
  EXPECT_FALSE(IsNearlyFull({}, 1'000, 0)) << "no reserve";
  EXPECT_FALSE(IsNearlyFull({.reserve_bytes = 50}, 1'000, 50));
  EXPECT_TRUE(IsNearlyFull({.reserve_bytes = 50}, 1'000, 49));
  EXPECT_FALSE(IsNearlyFull({.reserve_percent = 5}, 1'000, 50));
  EXPECT_TRUE(IsNearlyFull({.reserve_percent = 5}, 1'000, 49));
  EXPECT_TRUE(IsNearlyFull({.reserve_bytes = 10, .reserve_percent = 5}, 1'000, 49));
  EXPECT_TRUE(IsNearlyFull({.reserve_bytes = 60, .reserve_percent = 5}, 1'000, 59));
}

}  // namespace
}  // namespace axlecast
