#include "tools/fleet/ship/ship_status.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kUtime = 1'790'000'000'000'000;

std::vector<std::string> Names(const alarm_t& alarm) {
  std::vector<std::string> names;
  for (const alarm_entry_t& entry : alarm.entries) {
    if (entry.state == alarm_entry_t::STATE_LIVE) names.push_back(entry.name);
  }
  return names;
}

TEST(ShipAlarms, ReportAnAbsenceOfTenSecondsWithItsCause) {
  ShipAlarms alarms("press3", {.boot_id = 1});
  ShipStatus status{.problems = {.database = "The disk of the database is full"}, .away_since = kSecond};
  EXPECT_THAT(Names(alarms.Make(status, 10 * kSecond, kUtime)), IsEmpty());
  const alarm_t& away = alarms.Make(status, 11 * kSecond, kUtime);
  EXPECT_THAT(Names(away), ElementsAre("database_away"));
  EXPECT_EQ(away.entries[0].action, status.problems.database);
  status.connected = true;
  EXPECT_THAT(Names(alarms.Make(status, 12 * kSecond, kUtime)), IsEmpty());
}

TEST(ShipAlarms, ReportLagHolesAndFencing) {
  ShipAlarms alarms("press3", {.boot_id = 1});
  ShipStatus status{.connected = true, .holes = 2, .oldest_us = 600'000'000};
  EXPECT_THAT(Names(alarms.Make(status, kSecond, kUtime)), ElementsAre("logs_not_shipped", "hole_recorded"));
  status.oldest_us = 599'999'999;
  const alarm_t& later = alarms.Make(status, 2 * kSecond, kUtime);
  EXPECT_THAT(Names(later), IsEmpty());
  EXPECT_EQ(later.entries.at(0).state, alarm_entry_t::STATE_DRIVER_LATCHED);
  status.connected = false;
  status.fenced = true;
  EXPECT_THAT(Names(alarms.Make(status, 100 * kSecond, kUtime)), ElementsAre("shipper_fenced"));
}

TEST(ShipAlarms, ReportLogsThatCannotBeRead) {
  ShipAlarms alarms("press3", {.boot_id = 1});
  ShipStatus status{.connected = true, .problems = {.folder = "/var/log/axlecast: Permission denied"}};
  EXPECT_THAT(Names(alarms.Make(status, 20 * kSecond, kUtime)), IsEmpty());
  const alarm_t& folder = alarms.Make(status, 30 * kSecond, kUtime);
  EXPECT_THAT(Names(folder), ElementsAre("logs_not_shipped"));
  EXPECT_EQ(folder.entries[0].action, status.problems.folder);
  status.problems.folder.clear();
  EXPECT_THAT(Names(alarms.Make(status, 31 * kSecond, kUtime)), IsEmpty());
  status.skipped = {{.file = "m_1.lcm", .reason = "of another machine", .foreign = true}};
  EXPECT_THAT(Names(alarms.Make(status, 60 * kSecond, kUtime)), IsEmpty());
  status.skipped.push_back({.file = "a_1.lcm", .reason = "Permission denied"});
  EXPECT_THAT(Names(alarms.Make(status, 70 * kSecond, kUtime)), IsEmpty());
  const alarm_t& log = alarms.Make(status, 80 * kSecond, kUtime);
  EXPECT_THAT(Names(log), ElementsAre("logs_not_shipped"));
  EXPECT_EQ(log.entries[0].action, "a_1.lcm: Permission denied");
}

TEST(ShipStatusLine, HasWhatAnOperatorNeeds) {
  ShipStatus status{.connected = true,
                    .host = "db1",
                    .bytes = 1'200'000,
                    .samples = 250,
                    .lag_bytes = 3'400'000,
                    .lag_logs = 2,
                    .lag_us = 1'900'000};
  EXPECT_EQ(ShipStatusLine(status),
            "connected to db1, 2 s behind, 3.4 MB in 2 logs not shipped; shipped 250 samples, 0 events, 1.2 MB");
  status.connected = false;
  status.problems.database = "no route";
  status.holes = 1;
  EXPECT_THAT(ShipStatusLine(status), HasSubstr("no connection to the database"));
  EXPECT_THAT(ShipStatusLine(status), HasSubstr("1 holes; no route"));
  const auto json = ShipStatusJson("press3", "running", kUtime, status);
  EXPECT_EQ(json["lag_s"], 1.9);
  EXPECT_EQ(json["lag_bytes"], 3'400'000);
  // What keeps the logs from being read does not hide behind the connection.
  status.problems.folder = "the folder cannot be read";
  EXPECT_THAT(ShipStatusLine(status), HasSubstr("; no route; the folder cannot be read"));
}

}  // namespace
}  // namespace axlecast
