#include "tools/fleet/alarm_changes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/fleet/row_fixture.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Entries = std::vector<alarm_entry_t>;

// The rows of messages, as "appeared 7 at 100", with times in ms after kT0.
class AlarmChangesTest : public testing::Test {
 protected:
  std::vector<std::string> On(std::int64_t ms, Entries entries, std::int64_t boot_id = kBoot) {
    return On(AlarmsAt(kT0 + ms * 1'000, seq_++, std::move(entries)), boot_id);
  }
  std::vector<std::string> On(alarm_t message, std::int64_t boot_id = kBoot) {
    message.boot_id = boot_id;
    rows_.clear();
    changes_.On(message, kThisYear, rows_);
    std::vector<std::string> texts;
    for (const AlarmRow& row : rows_) {
      texts.push_back(std::string(AlarmChangeName(row.change)) + ' ' + std::to_string(row.code) + " at " +
                      std::to_string((row.t - kT0) / 1'000) + (row.cause.empty() ? "" : ' ' + row.cause));
    }
    return texts;
  }

  AlarmChanges changes_{"axis1"};
  std::int64_t seq_ = 0;
  std::vector<AlarmRow> rows_;
};

TEST_F(AlarmChangesTest, RepeatedMessagesChangeNothing) {
  EXPECT_THAT(On(1'000, {}), IsEmpty());
  EXPECT_THAT(On(2'010, {Alarm(7, kT0 + 2'000'000)}), ElementsAre("appeared 7 at 2000"));
  Entries seen_again{Alarm(7, kT0 + 2'000'000)};
  seen_again[0].last_utime = kT0 + 3'000'000;
  EXPECT_THAT(On(3'010, seen_again), IsEmpty());
  EXPECT_THAT(On(4'010, {}), ElementsAre("cleared 7 at 4010"));
  EXPECT_EQ(rows_[0].last_utime, kT0 + 3'000'000);
  EXPECT_THAT(On(5'010, {}), IsEmpty());
}

TEST_F(AlarmChangesTest, ChangesOfStateSeverityAndAction) {
  On(0, {Alarm(7, kT0)});
  EXPECT_THAT(On(10, {Alarm(7, kT0, alarm_entry_t::STATE_UNKNOWN)}), ElementsAre("changed 7 at 10"));
  EXPECT_EQ(rows_[0].state, alarm_entry_t::STATE_UNKNOWN);
  Entries worse{Alarm(7, kT0, alarm_entry_t::STATE_UNKNOWN)};
  worse[0].severity = alarm_entry_t::SEVERITY_CRITICAL;
  EXPECT_THAT(On(20, worse), ElementsAre("changed 7 at 20"));
  worse[0].action = "stop";
  EXPECT_THAT(On(30, worse), ElementsAre("changed 7 at 30"));
  EXPECT_THAT(On(40, worse), IsEmpty());
}

// It was absent between two messages that arrived.
TEST_F(AlarmChangesTest, ANewBeginIsAnotherAlarm) {
  On(0, {Alarm(7, kT0)});
  EXPECT_THAT(On(900, {Alarm(7, kT0 + 800'000)}), ElementsAre("cleared 7 at 900", "appeared 7 at 800"));
}

TEST_F(AlarmChangesTest, AlarmsOfOneCodeAndTwoSourcesAreTwo) {
  Entries entries{Alarm(7, kT0), Alarm(7, kT0)};
  entries[1].source = alarm_entry_t::SOURCE_BUS;
  EXPECT_THAT(On(0, entries), ElementsAre("appeared 7 at 0", "appeared 7 at 0"));
  entries.pop_back();
  EXPECT_THAT(On(10, entries), ElementsAre("cleared 7 at 10"));
  EXPECT_EQ(rows_[0].source, alarm_entry_t::SOURCE_BUS);
}

TEST_F(AlarmChangesTest, OneThatIsNotListedForLackOfRoomStays) {
  On(0, {Alarm(1, kT0), Alarm(2, kT0)});
  alarm_t full = AlarmsAt(kT0 + 10'000, seq_++, {Alarm(3, kT0 + 10'000), Alarm(1, kT0)});
  full.total = 3;
  EXPECT_THAT(On(full), ElementsAre("appeared 3 at 10"));
  EXPECT_THAT(On(20, {Alarm(1, kT0), Alarm(2, kT0)}), ElementsAre("cleared 3 at 20"));
  EXPECT_THAT(On(30, {Alarm(2, kT0)}), ElementsAre("cleared 1 at 30"));
}

TEST_F(AlarmChangesTest, ARestartClearsWhatTheEarlierProcessReported) {
  On(0, {Alarm(1, kT0), Alarm(2, kT0)});
  seq_ = 0;
  EXPECT_THAT(On(500, {Alarm(2, kT0 + 499'000)}, kBoot + 1),
              ElementsAre("cleared 1 at 500 restarted", "cleared 2 at 500 restarted", "appeared 2 at 499"));
  EXPECT_EQ(rows_[0].boot_id, kBoot);
  EXPECT_EQ(rows_[2].boot_id, kBoot + 1);
}

TEST_F(AlarmChangesTest, LateMessagesAreIgnored) {
  On(0, {Alarm(1, kT0)});
  const alarm_t late = AlarmsAt(kT0 + 10'000, seq_++, {Alarm(1, kT0)});
  EXPECT_THAT(On(20, {}), ElementsAre("cleared 1 at 20"));
  EXPECT_THAT(On(late), IsEmpty());
  EXPECT_THAT(On(30, {}, kBoot + 1), IsEmpty());
  EXPECT_THAT(On(late), IsEmpty());
}

TEST_F(AlarmChangesTest, ATimeOutOfRangeIsReplacedByTheMessages) {
  EXPECT_THAT(On(5, {Alarm(1, 0), Alarm(2, INT64_MAX)}), ElementsAre("appeared 1 at 5", "appeared 2 at 5"));
  EXPECT_EQ(rows_[1].first_utime, INT64_MAX);
}

TEST_F(AlarmChangesTest, RowsHoldTheEntry) {
  Entries entries{Alarm(7, kT0)};
  entries[0].name = std::string("a\0\xFF", 3);
  On(5, entries);
  ASSERT_EQ(rows_.size(), 1U);
  EXPECT_EQ(rows_[0].device, "axis1");
  EXPECT_EQ(rows_[0].name, "a\xEF\xBF\xBD\xEF\xBF\xBD");
  EXPECT_EQ(rows_[0].text, "replace the battery");
  EXPECT_EQ(rows_[0].severity, alarm_entry_t::SEVERITY_ERROR);
  EXPECT_THAT(rows_[0].message, HasSubstr("\"code\":7"));
  EXPECT_THAT(rows_[0].message, testing::Not(HasSubstr("\\u0000")));
}

TEST_F(AlarmChangesTest, OneAlarmTwiceInAMessageCountsOnce) {
  EXPECT_THAT(On(5, {Alarm(7, kT0), Alarm(7, kT0 + 1'000)}), ElementsAre("appeared 7 at 0"));
}

}  // namespace
}  // namespace axlecast
