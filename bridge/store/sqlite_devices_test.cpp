#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include "bridge/store/history.h"
#include "bridge/store/store_fixture.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
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
  ASSERT_TRUE(store->Apply("axis1", Mark(Kind::kAcknowledged)));
  ASSERT_TRUE(store->Apply("axis1", Mark(Kind::kShelved)));
  ASSERT_TRUE(store->Apply("axis2", Mark(Kind::kShelved)));
  const auto marks = SqliteStore(Copy(), "press3").Marks("axis1");
  ASSERT_EQ(marks.size(), 2);
  ExpectSame(marks[0], Mark(Kind::kAcknowledged));
  ExpectSame(marks[1], Mark(Kind::kShelved));
}

TEST_F(SqliteAlarmsTest, OneOfAKindTheNewest) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", Mark(Kind::kShelved)));
  AlarmMark other = Mark(Kind::kShelved);
  other.who = "local";
  ASSERT_TRUE(store->Apply("axis1", other));
  ASSERT_EQ(store->Marks("axis1").size(), 1);
  EXPECT_EQ(store->Marks("axis1")[0].who, "local");
  ASSERT_TRUE(store->Apply("axis1", AlarmMarkEnded{Kind::kAcknowledged, "battery_error"}));  // does not exist
  EXPECT_EQ(store->Marks("axis1").size(), 1);
  ASSERT_TRUE(store->Apply("axis1", AlarmMarkEnded{Kind::kShelved, "battery_error"}));
  EXPECT_TRUE(store->Marks("axis1").empty());
}

TEST_F(SqliteAlarmsTest, AJournalFromBeforeGetsTheTable) {
  OpenStore().reset();
  EXPECT_EQ(Ask("DROP TABLE alarm_marks"), "");
  HistoryReader reader(file_);
  EXPECT_TRUE(reader.AlarmMarks("axis1").empty());
  EXPECT_EQ(ErrorText(reader.state()), "");
  const auto store = OpenStore();
  EXPECT_EQ(ErrorText(store->state()), "");
  ASSERT_TRUE(store->Apply("axis1", Mark(Kind::kShelved)));
  ASSERT_EQ(HistoryReader(file_).AlarmMarks("axis1").size(), 1);
}

class SqliteAxesTest : public StoreTest {
 protected:
  static DatumRecord Datum(std::int64_t counts) {
    return {.counts = counts,
            .utime = kStart + counts,
            .identity = "17 SN0042",
            .value = "123.456 mm",
            .who = "plc",
            .command = NumberedId(7),
            .reason = "homing"};
  }
};

TEST_F(SqliteAxesTest, NothingIsKnownAtFirst) {
  const auto store = OpenStore();
  const AxisRecord axis = store->Find("axis1");
  EXPECT_EQ(axis.identity, "");
  EXPECT_FALSE(axis.reference_lost);
  EXPECT_EQ(axis.writes, 0);
  EXPECT_EQ(axis.since_utime, 0);
  EXPECT_FALSE(axis.position);
  EXPECT_FALSE(axis.datum);
  EXPECT_TRUE(store->Datums("axis1").empty());
}

TEST_F(SqliteAxesTest, ADatumIsKeptWholeAcrossACrash) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", Datum(INT64_MIN)));
  const AxisRecord axis = SqliteStore(Copy(), "press3").Find("axis1");
  ASSERT_TRUE(axis.datum);
  EXPECT_EQ(axis.datum->number, 1);
  EXPECT_EQ(axis.datum->counts, INT64_MIN);
  EXPECT_EQ(axis.datum->utime, Datum(INT64_MIN).utime);
  EXPECT_EQ(axis.datum->identity, "17 SN0042");
  EXPECT_EQ(axis.datum->value, "123.456 mm");
  EXPECT_EQ(axis.datum->who, "plc");
  EXPECT_EQ(axis.datum->command, NumberedId(7));
  EXPECT_EQ(axis.datum->reason, "homing");
  EXPECT_FALSE(store->Find("axis2").datum);
}

TEST_F(SqliteAxesTest, HistoryHoldsThoseThatWereVoidedToo) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", Datum(10)));
  ASSERT_TRUE(store->Apply("axis2", Datum(11)));
  ASSERT_TRUE(store->Apply("axis1", Datum(12)));
  EXPECT_EQ(store->Find("axis1").datum->counts, 12);
  ASSERT_TRUE(store->Apply("axis1", DatumVoided{kStart, "zeroed in the device"}));
  EXPECT_FALSE(store->Find("axis1").datum);
  ASSERT_TRUE(store->Apply("axis1", DatumVoided{kStart + 1, "again"})) << "no datum is in force";
  ASSERT_TRUE(store->Apply("axis9", DatumVoided{kStart + 1, "unknown"}));
  const auto datums = OpenStore()->Datums("axis1");
  ASSERT_EQ(datums.size(), 2U);
  EXPECT_EQ(datums[0].counts, 12);
  EXPECT_EQ(datums[1].counts, 10);
  EXPECT_GT(datums[0].number, datums[1].number);
  EXPECT_EQ(Ask("SELECT counts, voided_utime, voided_why FROM datums ORDER BY number"),
            "10||\n11||\n12|1700000000000000|zeroed in the device\n");
}

TEST_F(SqliteAxesTest, WritesAddUpSinceTheFirst) {
  auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", WritesAdded{3, kStart + 1}));
  ASSERT_TRUE(store->Apply("axis1", WritesAdded{4, kStart + 2}));
  store.reset();
  store = OpenStore();
  EXPECT_EQ(store->Find("axis1").writes, 7);
  EXPECT_EQ(store->Find("axis1").since_utime, kStart + 1);
  ASSERT_TRUE(store->Apply("axis1", WritesAdded{-2, kStart + 3}));  // counted before, and not made
  EXPECT_EQ(store->Find("axis1").writes, 5);
  ASSERT_TRUE(store->Apply("axis1", WritesAdded{-9, kStart + 4}));
  EXPECT_EQ(store->Find("axis1").writes, 0);
}

TEST_F(SqliteAxesTest, AnExchangeBeginsAnew) {
  auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", Datum(10)));
  ASSERT_TRUE(store->Apply("axis1", WritesAdded{3, kStart}));
  ASSERT_TRUE(store->Apply("axis1", ReferenceChanged{true}));
  ASSERT_TRUE(store->Apply("axis1", IdentityChanged{"17 SN0042"}));
  store->KeepPosition("axis1", {.counts = 5, .utime = kStart});
  EXPECT_TRUE(store->Find("axis1").reference_lost);
  EXPECT_EQ(store->Find("axis1").identity, "17 SN0042");
  ASSERT_TRUE(store->Apply("axis1", EncoderExchanged{"17 SN0043", kStart + 9}));
  store.reset();
  store = OpenStore();
  const AxisRecord axis = store->Find("axis1");
  EXPECT_EQ(axis.identity, "17 SN0043");
  EXPECT_FALSE(axis.reference_lost);
  EXPECT_EQ(axis.writes, 0);
  EXPECT_EQ(axis.since_utime, kStart + 9);
  EXPECT_FALSE(axis.position);
  EXPECT_FALSE(axis.datum);
  EXPECT_EQ(store->Datums("axis1").size(), 1U);
  EXPECT_EQ(Ask("SELECT voided_why FROM datums"), "the encoder was exchanged\n");
  ASSERT_TRUE(store->Apply("axis1", ReferenceChanged{true}));
  ASSERT_TRUE(store->Apply("axis1", ReferenceChanged{false}));
  EXPECT_FALSE(OpenStore()->Find("axis1").reference_lost);
}

TEST_F(SqliteAxesTest, PositionsAreWrittenOnceASecondTogether) {
  const auto store = OpenStore();
  const auto written = [this] { return Ask("SELECT device, position_counts FROM axes ORDER BY device"); };
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart});
  store->KeepPosition("axis2", {.counts = 2, .utime = kStart});
  EXPECT_EQ(store->Find("axis1").position->counts, 1);
  EXPECT_EQ(written(), "");
  store->Tick(At(10));
  EXPECT_EQ(written(), "axis1|1\naxis2|2\n");
  store->KeepPosition("axis1", {.counts = 3, .utime = kStart + 1});
  store->Tick(At(10.9));
  EXPECT_EQ(store->Find("axis1").position->counts, 3);
  EXPECT_EQ(written(), "axis1|1\naxis2|2\n");
  store->Tick(At(11));
  EXPECT_EQ(written(), "axis1|3\naxis2|2\n");
}

TEST_F(SqliteAxesTest, AShaftThatStandsStillIsWrittenOnceAMinuteAndAtTheEnd) {
  auto store = OpenStore();
  const auto written = [this] { return Ask("SELECT position_utime - 1700000000000000 FROM axes"); };
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart});
  store->Tick(At(10));
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart + 59'999'999});
  store->Tick(At(69));
  EXPECT_EQ(written(), "0\n");
  EXPECT_EQ(store->Find("axis1").position->utime, kStart + 59'999'999);
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart + 60'000'000});
  store->Tick(At(70));
  EXPECT_EQ(written(), "60000000\n");
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart + 61'000'000});
  store.reset();
  EXPECT_EQ(written(), "61000000\n");
}

TEST_F(SqliteAxesTest, APositionOutlivesTheBridge) {
  auto store = OpenStore();
  store->KeepPosition("axis1", {.counts = -5, .utime = kStart});
  store.reset();
  store = OpenStore();
  const AxisRecord axis = store->Find("axis1");
  ASSERT_TRUE(axis.position);
  EXPECT_EQ(axis.position->counts, -5);
  EXPECT_EQ(axis.position->utime, kStart);
  ASSERT_TRUE(store->Apply("axis1", DatumVoided{kStart, "zeroed"}));
  EXPECT_FALSE(store->Find("axis1").position);
}

TEST_F(SqliteAxesTest, APositionIsNotWrittenWithACommand) {
  const auto store = OpenStore();
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart});
  ASSERT_TRUE(store->Accepted(Command(1), At(0)));
  EXPECT_EQ(Ask("SELECT count(*) FROM axes"), "0\n");
  store->Tick(At(1));
  EXPECT_EQ(Ask("SELECT count(*) FROM axes"), "1\n");
}

TEST_F(SqliteAxesTest, AShaftThatStandsStillIsNotWrittenWithOneThatMoves) {
  const auto store = OpenStore();
  for (const int round : {0, 1}) {
    store->KeepPosition("axis1", {.counts = 1, .utime = kStart + round});
    store->KeepPosition("axis2", {.counts = 2 + round, .utime = kStart + round});
    store->Tick(At(10 + round));
  }
  EXPECT_EQ(Ask("SELECT position_counts, position_utime - 1700000000000000 FROM axes ORDER BY device"),
            "1|0\n3|1\n");
}

TEST_F(SqliteAxesTest, AShaftThatStandsStillIsWrittenAgainAfterUnixTimeWasSetBack) {
  const auto store = OpenStore();
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart});
  store->Tick(At(10));
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart - 1});
  store->Tick(At(20));
  EXPECT_EQ(Ask("SELECT position_utime - 1700000000000000 FROM axes"), "-1\n");
}

TEST_F(SqliteAxesTest, APositionAfterAnExchangeIsWrittenAlsoIfItIsThatOfBefore) {
  const auto store = OpenStore();
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart});
  store->Tick(At(10));
  ASSERT_TRUE(store->Apply("axis1", EncoderExchanged{"17", kStart}));
  EXPECT_EQ(Ask("SELECT position_counts FROM axes"), "\n");
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart});
  store->Tick(At(20));
  EXPECT_EQ(Ask("SELECT position_counts FROM axes"), "1\n");
}

TEST_F(SqliteAxesTest, ADatumThatNoCommandSetNamesNone) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", DatumRecord{.counts = 1}));
  ASSERT_TRUE(store->Apply("axis1", Datum(2)));
  EXPECT_EQ(Ask("SELECT command FROM datums ORDER BY number"), "\n07000000000000000000000000000000\n");
}

// A trigger fails the change in the table: the whole change is not made.
TEST_F(SqliteAxesTest, AChangeIsMadeWholeOrNotAtAll) {
  const auto store = OpenStore();
  ASSERT_TRUE(store->Apply("axis1", Datum(1)));
  ASSERT_TRUE(store->Apply("axis1", WritesAdded{3, kStart}));
  const std::string state = "SELECT * FROM axes; SELECT * FROM datums; SELECT * FROM alarm_marks";
  const std::string before = Ask(state);
  const std::pair<const char*, DeviceChange> changes[] = {
      {"INSERT ON datums", Datum(2)},
      {"INSERT ON axes", Datum(2)},
      {"UPDATE ON datums", DatumVoided{kStart, "zeroed"}},
      {"UPDATE ON axes", DatumVoided{kStart, "zeroed"}},
      {"INSERT ON axes", WritesAdded{3, kStart}},
      {"INSERT ON axes", ReferenceChanged{true}},
      {"INSERT ON axes", IdentityChanged{"17"}},
      {"UPDATE ON datums", EncoderExchanged{"17", kStart}},
      {"INSERT ON axes", EncoderExchanged{"17", kStart}},
      {"INSERT ON alarm_marks", AlarmMark{.alarm = "battery_error"}},
  };
  for (const auto& [what, change] : changes) {
    ASSERT_EQ(
        Ask(std::string("CREATE TRIGGER fails BEFORE ") + what + " BEGIN SELECT RAISE(ABORT, 'planted'); END"), "");
    EXPECT_FALSE(store->Apply("axis1", change)) << what;
    EXPECT_THAT(ErrorText(store->state()), HasSubstr("planted")) << what;
    EXPECT_EQ(Ask("DROP TRIGGER fails; " + state), before) << what;
  }
}

TEST_F(SqliteAxesTest, PositionsAndEventsThatCannotBeWrittenAreWrittenLater) {
  const auto store = OpenStore();
  store->KeepPosition("axis1", {.counts = 1, .utime = kStart});
  double seconds = 10;
  for (const std::string table : {"axes", "events"}) {
    ASSERT_EQ(Ask("CREATE TRIGGER fails BEFORE INSERT ON " + table + " BEGIN SELECT RAISE(ABORT, 'planted'); END"),
              "");
    store->Note({kStart, "axis1", "moved_while_off", table});
    EXPECT_EQ(ErrorText(store->state()).empty(), table == "axes") << "positions wait for the next tick";
    store->Tick(At(seconds));
    EXPECT_THAT(ErrorText(store->state()), HasSubstr("planted")) << table;
    ASSERT_EQ(Ask("DROP TRIGGER fails"), "");
    store->Tick(At(seconds + 1));
    EXPECT_EQ(ErrorText(store->state()), "");
    store->KeepPosition("axis1", {.counts = 2, .utime = kStart});
    seconds += 10;
  }
  store->Tick(At(seconds));
  EXPECT_EQ(Ask("SELECT position_counts FROM axes; SELECT text FROM events"), "2\naxes\nevents\n");
}

TEST_F(SqliteAxesTest, OfEventsThatCannotBeWrittenTheOldestIsForgotten) {
  const std::string blocker = folder_.path() + "/state";
  std::ofstream(blocker) << "a file where a folder should be";
  const auto store = OpenStore();
  for (std::size_t number = 0; number < SqliteAxes::kMaxEvents + 1; ++number) {
    store->Note({static_cast<std::int64_t>(number), "axis1", "moved_while_off", "text"});
  }
  std::filesystem::remove(blocker);
  store->Tick(At(10));
  EXPECT_EQ(Ask("SELECT min(utime), max(utime), count(*) FROM events"), "1|1000|1000\n");
}

TEST_F(SqliteAxesTest, EventsAreKept) {
  const auto store = OpenStore();
  store->Note({kStart, "axis1", "moved_while_off", "by 0.7 turns"});
  store->Note({kStart + 1, "", "journal_replaced", "text"});
  EXPECT_EQ(Ask("SELECT utime, device, kind, text FROM events"),
            "1700000000000000|axis1|moved_while_off|by 0.7 turns\n1700000000000001||journal_replaced|text\n");
}

}  // namespace

}  // namespace axlecast
