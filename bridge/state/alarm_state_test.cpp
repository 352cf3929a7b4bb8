#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "bridge/state/device_state.h"
#include "bridge/store/memory_store_fixture.h"
#include "core/alarm/alarm_table.h"
#include "core/command/commands.h"
#include "tests/support/counting_family.h"

namespace axlecast {
namespace {

using S = command_status_t;
using Kind = AlarmMark::Kind;
using Names = std::vector<std::string>;

constexpr std::int64_t kBoot = 7;
constexpr std::int64_t kNow = 1'000'000'000;  // us

// The acknowledged and shelved alarms of axis1, and a driver that has started as kBoot.
class AlarmStateTest : public testing::Test {
 protected:
  void Have(Kind kind, const std::string& alarm, std::int64_t until = kNow + 60'000'000,
            std::int64_t boot = kBoot) {
    ASSERT_TRUE(store_.Apply("axis1", AlarmMark{.kind = kind,
                                                .alarm = alarm,
                                                .utime = kNow - 10,
                                                .until_utime = until,
                                                .up_to = "error",
                                                .driver_boot_id = boot,
                                                .known_utime = kNow - 10}));
  }
  std::vector<AlarmMark> Marks() { return store_.Marks("axis1"); }
  Names Alarms() {
    Names names;
    for (const AlarmMark& mark : Marks()) names.push_back(mark.alarm);
    return names;
  }
  PendingCommand Command(const std::string& operation, std::int8_t state = S::STATE_SUCCEEDED,
                         const std::string& alarm = "battery_error") {
    PendingCommand pending;
    pending.id = NumberedId(5);
    pending.device = "axis1";
    pending.operation = FindOperation(CountingFamily(), operation);
    pending.arguments = {{"alarm", alarm}};
    pending.who = "anna";
    pending.reason = "known";
    pending.status.operation = operation;
    pending.status.state = state;
    pending.status.driver_boot_id = kBoot;
    pending.status.finished_utime = kNow;
    return pending;
  }
  PendingCommand Shelve(const std::string& alarm = "battery_error") {
    PendingCommand shelve = Command("shelve_alarm", S::STATE_SUCCEEDED, alarm);
    shelve.status.changes = {{"alarm", "present", "shelved"},
                             {"until", "", std::to_string(kNow + 60'000'000)},
                             {"up_to", "", "warning"}};
    return shelve;
  }
  void SayAcknowledged(const std::string& names, std::int64_t utime = kNow, std::int64_t boot = kBoot) {
    driver_status_t status{};
    status.kind = driver_status_t::KIND_ACKNOWLEDGED;
    status.device = "axis1";
    status.boot_id = boot;
    status.utime = utime;
    status.text = names;
    alarms_.OnAcknowledged(status);
  }

  const Timestamp now_{50 * kSecond, kNow};
  MemoryStore store_;
  AlarmStateStore alarms_{store_};
};

// ---- what a restarted driver receives ----

TEST_F(AlarmStateTest, ARestartedDriverReceivesWhatItDoesNotKnow) {
  Have(Kind::kAcknowledged, "battery_error");
  EXPECT_FALSE(alarms_.OnHello("axis1", kBoot, now_)) << "this driver knows";
  const auto given = alarms_.OnHello("axis1", kBoot + 1, now_);
  ASSERT_TRUE(given);
  EXPECT_EQ(given->operation, "restore_acknowledgement");
  ASSERT_EQ(given->arguments.size(), 1U);
  EXPECT_EQ(given->arguments[0].key, "alarm");
  EXPECT_EQ(given->arguments[0].value, "battery_error");
}

TEST_F(AlarmStateTest, AShelfIsGivenBackWithItsEndAndItsSeverity) {
  Have(Kind::kShelved, "over_speed");
  const auto given = alarms_.OnHello("axis1", kBoot + 1, now_);
  ASSERT_TRUE(given);
  EXPECT_EQ(given->operation, "shelve_alarm");
  Names values;
  for (const argument_t& argument : given->arguments) values.push_back(argument.key + '=' + argument.value);
  EXPECT_EQ(values, (Names{"alarm=over_speed", "until=" + std::to_string(kNow + 60'000'000), "up_to=error"}));
}

TEST_F(AlarmStateTest, TheFirstOfSeveralIsGivenBackFirst) {
  Have(Kind::kShelved, "a");
  Have(Kind::kShelved, "b");
  EXPECT_EQ(alarms_.OnHello("axis1", kBoot + 1, now_)->arguments[0].value, "a");
}

TEST_F(AlarmStateTest, AShelfEndsWithItsTime) {
  Have(Kind::kShelved, "ends_now", kNow);
  Have(Kind::kShelved, "ends_later", kNow + 1);
  Have(Kind::kAcknowledged, "has_no_end", 0);
  EXPECT_FALSE(alarms_.OnHello("axis1", kBoot, now_));
  EXPECT_EQ(Alarms(), (Names{"has_no_end", "ends_later"}));
}

TEST_F(AlarmStateTest, AShelfThatHasEndedIsNotGivenBack) {
  Have(Kind::kShelved, "ended", kNow - 1);
  EXPECT_FALSE(alarms_.OnHello("axis1", kBoot + 1, now_));
}

TEST_F(AlarmStateTest, WhatWasGivenBackIsKnownToThatDriver) {
  Have(Kind::kShelved, "battery_error", kNow + 9, kBoot - 1);
  Have(Kind::kShelved, "other", kNow + 9, kBoot - 1);
  Have(Kind::kAcknowledged, "battery_error", 0, kBoot - 1);
  PendingCommand restore = Command("shelve_alarm", S::STATE_RUNNING);
  restore.purpose = PendingCommand::Purpose::kRestore;
  alarms_.OnOutcome(restore);
  for (const AlarmMark& mark : Marks()) EXPECT_EQ(mark.driver_boot_id, kBoot - 1) << mark.alarm;
  // A driver that has refused it is not asked again.
  for (const std::int8_t state : {S::STATE_SUCCEEDED, S::STATE_REJECTED}) {
    Have(Kind::kShelved, "battery_error", kNow + 9, kBoot - 1);
    restore.status.state = state;
    alarms_.OnOutcome(restore);
    const auto marks = Marks();
    ASSERT_EQ(marks.size(), 3U);
    EXPECT_EQ(marks[0].driver_boot_id, kBoot - 1) << "the acknowledgement is not restored yet";
    EXPECT_EQ(marks[1].alarm, "battery_error");
    EXPECT_EQ(marks[1].driver_boot_id, kBoot);
    EXPECT_EQ(marks[1].known_utime, kNow);
    EXPECT_EQ(marks[1].until_utime, kNow + 9) << "the rest stays";
    EXPECT_EQ(marks[2].driver_boot_id, kBoot - 1) << "another alarm";
  }
  restore = Command("restore_acknowledgement");
  restore.purpose = PendingCommand::Purpose::kRestore;
  alarms_.OnOutcome(restore);
  EXPECT_EQ(Marks()[0].driver_boot_id, kBoot);
}

// ---- what is kept of commands ----

TEST_F(AlarmStateTest, AnAcknowledgementIsKeptWithWhoAndWhy) {
  PendingCommand acknowledge = Command("acknowledge_alarm");
  acknowledge.status.changes = {{"alarm", "present", "acknowledged"}};
  alarms_.OnOutcome(acknowledge);
  ASSERT_EQ(Marks().size(), 1U);
  const AlarmMark mark = Marks()[0];
  EXPECT_EQ(mark.kind, Kind::kAcknowledged);
  EXPECT_EQ(mark.alarm, "battery_error");
  EXPECT_EQ(mark.utime, kNow);
  EXPECT_EQ(mark.until_utime, 0);
  EXPECT_EQ(mark.who, "anna");
  EXPECT_EQ(mark.reason, "known");
  EXPECT_EQ(mark.command, NumberedId(5));
  EXPECT_EQ(mark.driver_boot_id, kBoot);
  EXPECT_EQ(mark.known_utime, kNow);
  EXPECT_EQ(acknowledge.status.text, "");
}

TEST_F(AlarmStateTest, OnlyTheFirstAcknowledgementIsKept) {
  PendingCommand acknowledge = Command("acknowledge_alarm");
  for (const change_t& change :
       {change_t{"alarm", "acknowledged", "acknowledged"}, change_t{"alarm", "gone", "cleared"},
        change_t{"other", "present", "acknowledged"}}) {
    acknowledge.status.changes = {change};
    alarms_.OnOutcome(acknowledge);
    EXPECT_TRUE(Marks().empty()) << change.key << ' ' << change.before << ' ' << change.after;
  }
}

TEST_F(AlarmStateTest, AShelfIsKeptUntilItIsUnshelved) {
  PendingCommand shelve = Shelve();
  alarms_.OnOutcome(shelve);
  ASSERT_EQ(Marks().size(), 1U);
  EXPECT_EQ(Marks()[0].kind, Kind::kShelved);
  EXPECT_EQ(Marks()[0].until_utime, kNow + 60'000'000);
  EXPECT_EQ(Marks()[0].up_to, "warning");
  Have(Kind::kShelved, "other");
  PendingCommand unshelve = Command("unshelve_alarm", S::STATE_FAILED);
  alarms_.OnOutcome(unshelve);
  EXPECT_EQ(Marks().size(), 2U);
  unshelve.status.state = S::STATE_SUCCEEDED;
  alarms_.OnOutcome(unshelve);
  EXPECT_EQ(Alarms(), Names{"other"});
}

TEST_F(AlarmStateTest, WhatWasNotDoneIsNotKept) {
  PendingCommand shelve = Shelve();
  shelve.status.state = S::STATE_FAILED;
  alarms_.OnOutcome(shelve);
  EXPECT_TRUE(Marks().empty());
  shelve = Shelve();
  shelve.prepare = true;
  alarms_.OnOutcome(shelve);
  EXPECT_TRUE(Marks().empty()) << "it was only prepared";
  shelve.prepare = false;
  shelve.operation = nullptr;
  alarms_.OnOutcome(shelve);
  EXPECT_TRUE(Marks().empty());
}

TEST_F(AlarmStateTest, AnotherOperationIsNoMatterOfAlarms) {
  PendingCommand bump = Command("bump");
  bump.status.changes = {{"alarm", "present", "acknowledged"}};
  alarms_.OnOutcome(bump);
  EXPECT_TRUE(Marks().empty());
  Have(Kind::kAcknowledged, "battery_error", 0, kBoot - 1);
  bump.purpose = PendingCommand::Purpose::kRestore;
  alarms_.OnOutcome(bump);
  EXPECT_EQ(Marks()[0].driver_boot_id, kBoot - 1);
}

TEST_F(AlarmStateTest, WhatTheJournalDoesNotTakeIsToldInTheOutcome) {
  store_.fails = true;
  PendingCommand shelve = Shelve();
  shelve.status.text = "shelved";
  alarms_.OnOutcome(shelve);
  EXPECT_EQ(shelve.status.text, "shelved; the journal could not keep it: it is lost when the driver ends");
}

// ---- as many as a driver takes ----

TEST_F(AlarmStateTest, NoMoreAreShelvedThanADriverTakes) {
  for (std::size_t i = 0; i + 1 < AlarmShelves::kMax; ++i) Have(Kind::kShelved, "alarm" + std::to_string(i));
  Have(Kind::kAcknowledged, "acknowledged");
  Have(Kind::kShelved, "ended", kNow);
  EXPECT_TRUE(alarms_.BeforeRoute(Shelve(), now_)) << "the last";
  Have(Kind::kShelved, "one_more", kNow + 1);
  const auto refused = alarms_.BeforeRoute(Shelve(), now_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, S::REASON_BAD_ARGUMENT);
  EXPECT_EQ(refused.error().text, "32 alarms of this device are shelved: unshelve some first");
  EXPECT_TRUE(alarms_.BeforeRoute(Shelve("alarm7"), now_)) << "it has a place";
  EXPECT_TRUE(alarms_.BeforeRoute(Command("acknowledge_alarm"), now_)) << "it needs none";
}

TEST_F(AlarmStateTest, AShelfThatComesLateMayFindNoRoom) {
  for (std::size_t i = 0; i < AlarmShelves::kMax; ++i) Have(Kind::kShelved, "alarm" + std::to_string(i));
  PendingCommand shelve = Shelve();
  shelve.status.text = "shelved";
  alarms_.OnOutcome(shelve);
  EXPECT_EQ(Marks().size(), AlarmShelves::kMax);
  EXPECT_EQ(shelve.status.text,
            "shelved; 32 alarms of this device are shelved: unshelve some first: it is lost when the driver ends");
  PendingCommand acknowledge = Command("acknowledge_alarm");
  acknowledge.status.changes = {{"alarm", "present", "acknowledged"}};
  alarms_.OnOutcome(acknowledge);
  EXPECT_EQ(Marks().size(), AlarmShelves::kMax + 1) << "acknowledgements take no room";
}

// ---- what the driver reports as acknowledged ----

TEST_F(AlarmStateTest, AnAcknowledgementEndsWhenTheDriverNamesItNoMore) {
  Have(Kind::kAcknowledged, "battery_error");
  Have(Kind::kAcknowledged, "over_speed");
  Have(Kind::kShelved, "over_speed");
  SayAcknowledged("over_speed battery_error");
  EXPECT_EQ(Alarms(), (Names{"battery_error", "over_speed", "over_speed"}));
  SayAcknowledged("battery_error");
  EXPECT_EQ(Alarms(), (Names{"battery_error", "over_speed"}));
  EXPECT_EQ(Marks()[1].kind, Kind::kShelved) << "shelves are not acknowledgements";
  SayAcknowledged("battery *");
  EXPECT_EQ(Alarms().size(), 2U) << "the list is incomplete";
  SayAcknowledged("battery");
  EXPECT_EQ(Alarms(), Names{"over_speed"});
}

TEST_F(AlarmStateTest, OnlyADriverThatKnowsCanEndAnAcknowledgement) {
  Have(Kind::kAcknowledged, "battery_error");
  SayAcknowledged("", kNow, kBoot + 1);
  EXPECT_EQ(Alarms().size(), 1U) << "another boot";
  SayAcknowledged("", kNow - 10);
  EXPECT_EQ(Alarms().size(), 1U) << "a message of the time at which it learned it";
  SayAcknowledged("", kNow - 9);
  EXPECT_TRUE(Alarms().empty());
}

}  // namespace
}  // namespace axlecast
