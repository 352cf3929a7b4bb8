#include "tools/fleet/ship/row_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::int64_t kT0 = 1'790'000'000'000'000;
constexpr std::int64_t kDay = 86'400'000'000;

// The number of columns that the name of a table lists.
int Columns(const std::string& table) { return static_cast<int>(std::ranges::count(table, ',')) + 1; }

// The number of columns in the first row: after the header of 19 bytes.
int FirstRow(const db::CopyRows& rows) {
  const std::string_view bytes = rows.encoded();
  return static_cast<unsigned char>(bytes[19]) << 8 | static_cast<unsigned char>(bytes[20]);
}

BatchRows OneOfEach() {
  BatchRows batch;
  batch.streams.resize(1);
  batch.chunks.push_back({.t0 = kT0, .t1 = kT0, .summary = {.n = 1}, .stream = 0, .body = {1, 0}});
  batch.seconds.push_back({.t = kT0, .summary = {.n = 1}, .stream = 0});
  batch.minutes.push_back({.t = kT0 - kDay, .summary = {.n = 1}, .stream = 0});
  batch.devices.push_back({.t = kT0, .message = "{}"});
  batch.buses.push_back({.t = kT0, .message = "{}"});
  batch.recorders.push_back({.t = kT0, .message = "{}"});
  batch.motors.push_back({.t = kT0, .message = "{}"});
  batch.clocks.push_back({.t = kT0, .message = "{}"});
  batch.raw.push_back({.n = 1, .t0 = kT0 + kDay, .t1 = kT0 + kDay});
  batch.odd.push_back({.event = 3, .channel = "X", .utime = INT64_MIN});
  batch.alarms.push_back({.t = kT0, .cause = "", .message = "{}"});
  batch.commands.push_back({.t = kT0, .state = "issued", .message = "{}"});
  batch.trips.push_back({.t = kT0, .message = "{}"});
  batch.machine_files.emplace_back();
  return batch;
}

TEST(CopyTables, EachRowHasTheColumnsThatAreNamed) {
  const std::vector<TableRows> tables = CopyTables(OneOfEach(), {.machine = 1, .log = 2, .streams = {3}});
  EXPECT_EQ(tables.size(), 8U);
  for (const TableRows& table : tables) {
    EXPECT_EQ(FirstRow(table.rows), Columns(table.table)) << table.table;
    EXPECT_EQ(table.rows.size(), 1U) << table.table;
  }
  EXPECT_THAT(CopyTables({}, {}), IsEmpty());
}

TEST(InsertStatements, ThereIsOneForEachKind) {
  const std::vector<RowStatement> statements =
      InsertStatements(OneOfEach(), {.machine = 1, .log = 2, .streams = {3}});
  std::vector<std::string> tables;
  for (const RowStatement& statement : statements)
    tables.push_back(statement.sql.substr(0, statement.sql.find(" (")));
  EXPECT_THAT(tables, ElementsAre("INSERT INTO axlecast.position_second AS p",
                                  "INSERT INTO axlecast.position_minute AS p", "INSERT INTO axlecast.alarm",
                                  "INSERT INTO axlecast.command", "INSERT INTO axlecast.trip", "WITH file AS"));
  EXPECT_THAT(statements.back().sql, AllOf(HasSubstr("(INSERT INTO axlecast.machine_file ("),
                                           HasSubstr("UPDATE axlecast.log SET machine_file = ")));
  EXPECT_THAT(InsertStatements({}, {}), IsEmpty());
}

TEST(DaysOf, AreThoseOfPartitionedTables) {
  const std::int64_t day = kT0 / kDay;
  EXPECT_THAT(DaysOf(OneOfEach()), ElementsAre(day - 1, day, day + 1));
  BatchRows old;
  old.devices.push_back({.t = -1});
  EXPECT_THAT(DaysOf(old), ElementsAre(-1));
}

TEST(EventRows, DoNotCountPositions) { EXPECT_EQ(EventRows(OneOfEach()), 10); }

}  // namespace
}  // namespace axlecast
