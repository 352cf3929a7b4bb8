#include "bridge/store/sqlite_alarms.h"

#include <gtest/gtest.h>

#include "bridge/store/history.h"
#include "bridge/store/store_fixture.h"

namespace axlecast {
namespace {

using Kind = AlarmMark::Kind;

class SqliteAlarmsTest : public StoreTest {
 protected:
  static AlarmMark Mark(Kind kind, const std::string& alarm = "battery_error") {
    return {.kind = kind,
            .alarm = alarm,
            .utime = kStart,
            .until_utime = kind == Kind::kShelved ? kStart + 60 : 0,
            .up_to = kind == Kind::kShelved ? "error" : "",
            .who = "plc",
            .reason = "it's known",
            .command = NumberedId(7),
            .driver_boot_id = INT64_MIN,
            .known_utime = kStart + 1};
  }
  static void ExpectSame(const AlarmMark& a, const AlarmMark& b) {
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_EQ(a.alarm, b.alarm);
    EXPECT_EQ(a.utime, b.utime);
    EXPECT_EQ(a.until_utime, b.until_utime);
    EXPECT_EQ(a.up_to, b.up_to);
    EXPECT_EQ(a.who, b.who);
    EXPECT_EQ(a.reason, b.reason);
    EXPECT_EQ(a.command, b.command);
    EXPECT_EQ(a.driver_boot_id, b.driver_boot_id);
    EXPECT_EQ(a.known_utime, b.known_utime);
  }
};

TEST_F(SqliteAlarmsTest, MarksAreKeptWholeAcrossACrash) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->SetMark("axis1", Mark(Kind::kAcknowledged)));
  ASSERT_TRUE(store->SetMark("axis1", Mark(Kind::kShelved)));
  ASSERT_TRUE(store->SetMark("axis2", Mark(Kind::kShelved)));
  const auto marks = SqliteStore(Copy(), "press3").Marks("axis1");
  ASSERT_EQ(marks.size(), 2);
  ExpectSame(marks[0], Mark(Kind::kAcknowledged));
  ExpectSame(marks[1], Mark(Kind::kShelved));
}

TEST_F(SqliteAlarmsTest, OneOfAKindTheNewest) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->SetMark("axis1", Mark(Kind::kShelved)));
  AlarmMark other = Mark(Kind::kShelved);
  other.who = "local";
  ASSERT_TRUE(store->SetMark("axis1", other));
  ASSERT_EQ(store->Marks("axis1").size(), 1);
  EXPECT_EQ(store->Marks("axis1")[0].who, "local");
  ASSERT_TRUE(store->EndMark("axis1", Kind::kAcknowledged, "battery_error"));  // there is none
  EXPECT_EQ(store->Marks("axis1").size(), 1);
  ASSERT_TRUE(store->EndMark("axis1", Kind::kShelved, "battery_error"));
  EXPECT_TRUE(store->Marks("axis1").empty());
}

TEST_F(SqliteAlarmsTest, AJournalFromBeforeGetsTheTable) {
  OpenStore().reset();
  EXPECT_EQ(Ask("DROP TABLE alarm_marks"), "");
  HistoryReader reader(file_);
  EXPECT_TRUE(reader.AlarmMarks("axis1").empty());
  EXPECT_EQ(reader.problem(), "");
  const auto store = OpenStore();
  EXPECT_EQ(store->problem(), "");
  ASSERT_TRUE(store->SetMark("axis1", Mark(Kind::kShelved)));
  ASSERT_EQ(HistoryReader(file_).AlarmMarks("axis1").size(), 1);
}

}  // namespace
}  // namespace axlecast
