#include "tools/fleet/read/fleet_status.h"

#include <gmock/gmock.h>

#include "tools/fleet/read/event_query.h"
#include "tools/fleet/read/fleet_admin.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::int64_t kNow = 1'795'244'405'000'000;

MachineStatus Machine() {
  return {.name = "press3",
          .shipper = "host 1",
          .last_utime = kNow - 2'000'000,
          .last_batch = kNow - 1'000'000,
          .lag_bytes = 1'500'000,
          .lag_logs = 2,
          .holes = 3,
          .new_holes = 0,
          .odd = 4,
          .samples_per_s = 2'500,
          .free_bytes = 20'000'000'000};
}

std::vector<ServerStatus> Servers(const MachineStatus& machine) {
  return {{.host = "db1",
           .identity = "1",
           .error = "",
           .now = kNow,
           .schema_version = 5,
           .database_bytes = 3'000'000'000,
           .tables = {{"position_chunk", 2'000'000'000}},
           .machines = {machine}}};
}

TEST(FleetStatus, CallsAMachineLateByTheAgeOfItsNewestMessage) {
  MachineStatus machine = Machine();
  EXPECT_FALSE(IsLate(machine, kNow, {}));
  machine.last_utime = kNow - 60'000'000;
  EXPECT_FALSE(IsLate(machine, kNow, {}));
  machine.last_utime = kNow - 60'000'001;
  EXPECT_TRUE(IsLate(machine, kNow, {}));
  EXPECT_FALSE(IsLate(machine, kNow, {.late_us = 120'000'000}));
  machine.last_utime.reset();
  EXPECT_TRUE(IsLate(machine, kNow, {}));
}

TEST(FleetStatus, NeedsAttentionForANewHoleOnly) {
  MachineStatus machine = Machine();
  EXPECT_FALSE(NeedsAttention(machine, kNow, {}));
  machine.new_holes = 1;
  EXPECT_TRUE(NeedsAttention(machine, kNow, {}));
  EXPECT_THAT(FleetStatusText(Servers(machine), {}), HasSubstr("OK+HOLES"));
}

TEST(FleetStatus, ShowsAMachineInOneLine) {
  const std::string text = FleetStatusText(Servers(Machine()), {});
  EXPECT_THAT(
      text,
      HasSubstr("press3                   OK         2026-11-21 07:00:03    2.0 s    1.5 MB     2      3     4"));
  EXPECT_THAT(text, HasSubstr("2500   20.0 GB"));
  EXPECT_THAT(text, HasSubstr("server db1: schema version 5, 3.0 GB (position_chunk 2.0 GB)"));
}

TEST(FleetStatus, ShowsUnknownValuesAsSuch) {
  MachineStatus machine;
  machine.name = "new\x1b[31m";
  const std::string text = FleetStatusText(Servers(machine), {});
  EXPECT_THAT(text, HasSubstr("LATE       -                      never"));
  const auto json = FleetStatusJson(Servers(machine), {}).at("servers").at(0).at("machines").at(0);
  EXPECT_TRUE(json.at("age_us").is_null());
  EXPECT_TRUE(json.at("samples_per_s").is_null());
  EXPECT_EQ(json.at("late"), true);
}

TEST(FleetStatus, ShowsAShardThatDoesNotAnswer) {
  const std::vector<ServerStatus> servers = {
      {.host = "host=db9", .identity = "", .error = "no route", .tables = {}, .machines = {}}};
  EXPECT_THAT(FleetStatusText(servers, {}), HasSubstr("server host=db9: no route"));
  EXPECT_EQ(FleetStatusJson(servers, {}).at("servers").at(0).at("error"), "no route");
  EXPECT_FALSE(FleetStatusJson(servers, {}).at("servers").at(0).contains("machines"));
}

TEST(FleetAdmin, RecognisesUuids) {
  EXPECT_TRUE(IsUuid("0f0e9b5c-7c1b-4d7f-9d0b-2f4f3f1f9f11"));
  EXPECT_TRUE(IsUuid("0F0E9B5C-7C1B-4D7F-9D0B-2F4F3F1F9F11"));
  for (const char* text : {"", "0f0e9b5c7c1b4d7f9d0b2f4f3f1f9f11", "0f0e9b5c-7c1b-4d7f-9d0b-2f4f3f1f9f1g",
                           "0f0e9b5c-7c1b-4d7f-9d0b-2f4f3f1f9f111", "0f0e9b5c-7c1b-4d7f-9d0b_2f4f3f1f9f11"}) {
    EXPECT_FALSE(IsUuid(text)) << text;
  }
}

TEST(EventQuery, HasTheColumnsOfEachTable) {
  for (const EventTable& table : EventTables()) {
    const std::vector<std::string> columns = EventColumns(table, *table.message != 0);
    EXPECT_EQ(columns[0], "utime") << table.kind;
    EXPECT_EQ(std::set<std::string>(columns.begin(), columns.end()).size(), columns.size()) << table.kind;
    EXPECT_EQ(columns.back() == "message", *table.message != 0) << table.kind;
  }
}

}  // namespace
}  // namespace axlecast
