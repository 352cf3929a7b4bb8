#include <gtest/gtest.h>

#include "core/alarm/alarm_table.h"

namespace axlecast {
namespace {

using E = alarm_entry_t;

constexpr AlarmSpec kBattery = {6, E::SOURCE_DEVICE, E::SEVERITY_ERROR, "battery_error", "Replace the battery."};
constexpr AlarmSpec kLow = {7, E::SOURCE_DEVICE, E::SEVERITY_WARNING, "battery_alarm", "Replace the battery soon."};
constexpr std::int64_t kHour = 3'600'000'000;

// What operators do with alarms: acknowledged, shelved.
class AlarmMarksTest : public testing::Test {
 protected:
  const alarm_t& Message() {
    book_.Write(message_, utime_);
    return message_;
  }
  void Set(const AlarmSpec& alarm, bool present) {
    book_.Set(alarm, present ? AlarmState::kLive : AlarmState::kAbsent, ++utime_);
  }
  AlarmTable book_{E::SEVERITY_ERROR};
  alarm_t message_{};
  std::int64_t utime_ = 1'000 * kHour;
};

TEST_F(AlarmMarksTest, WhatGoesUnacknowledgedStaysUntilItIs) {
  Set(kBattery, true);
  Set(kBattery, false);
  ASSERT_EQ(Message().n, 1);
  EXPECT_EQ(Message().entries[0].state, E::STATE_UNACKNOWLEDGED);
  EXPECT_EQ(book_.Worst(E::SEVERITY_INFO), nullptr);  // it is not present
  book_.Acknowledge("battery_error");
  EXPECT_EQ(Message().n, 0);
}

TEST_F(AlarmMarksTest, WhatWasAcknowledgedOrNeedsItNotGoesAtOnce) {
  Set(kBattery, true);
  Set(kLow, true);
  book_.Acknowledge("battery_error");
  EXPECT_EQ(Message().entries[0].state, E::STATE_LIVE);  // acknowledging clears nothing
  EXPECT_TRUE(book_.Look("battery_error").acknowledged);
  Set(kBattery, false);
  Set(kLow, false);
  EXPECT_EQ(Message().n, 0);
}

TEST_F(AlarmMarksTest, WhatComesAgainIsNew) {
  Set(kBattery, true);
  book_.Acknowledge("battery_error");
  EXPECT_EQ(book_.Acknowledged(), std::vector<std::string>{"battery_error"});
  const std::int64_t before = book_.acknowledged_revision();
  Set(kBattery, false);
  EXPECT_GT(book_.acknowledged_revision(), before);
  EXPECT_TRUE(book_.Acknowledged().empty());
  Set(kBattery, true);
  EXPECT_FALSE(book_.Look("battery_error").acknowledged);
  Set(kBattery, false);
  EXPECT_EQ(Message().entries[0].state, E::STATE_UNACKNOWLEDGED);
  Set(kBattery, true);
  EXPECT_EQ(Message().n, 1);
  EXPECT_EQ(Message().entries[0].state, E::STATE_LIVE);
}

TEST_F(AlarmMarksTest, WhatGetsWorseIsNewAndNotHidden) {
  AlarmSpec alarm = kLow;
  Set(alarm, true);
  book_.Acknowledge("battery_alarm");
  book_.Shelve({"battery_alarm", utime_ + kHour, alarm.severity});
  EXPECT_EQ(Message().entries[0].state, E::STATE_SHELVED);
  alarm.severity = E::SEVERITY_CRITICAL;
  Set(alarm, true);
  EXPECT_EQ(Message().entries[0].state, E::STATE_LIVE);
  EXPECT_EQ(Message().entries[0].severity, E::SEVERITY_CRITICAL);
  EXPECT_FALSE(book_.Look("battery_alarm").acknowledged);
}

TEST_F(AlarmMarksTest, AShelfEndsByItselfAndHidesNoStateOfTheDevice) {
  Set(kBattery, true);
  Set(kLow, true);
  book_.Shelve({"battery_error", utime_ + kHour, E::SEVERITY_ERROR});
  ASSERT_EQ(Message().n, 2);
  EXPECT_EQ(Message().entries[0].name, "battery_alarm");  // what is shelved comes last
  EXPECT_EQ(Message().entries[1].state, E::STATE_SHELVED);
  EXPECT_EQ(book_.Worst(E::SEVERITY_ERROR)->code, kBattery.code);
  const std::int64_t before = book_.revision();
  book_.Tick(utime_ + kHour - 1);
  EXPECT_EQ(book_.revision(), before);
  book_.Tick(utime_ + kHour);
  EXPECT_EQ(Message().entries[0].name, "battery_error");
  EXPECT_EQ(Message().entries[0].state, E::STATE_LIVE);
}

TEST_F(AlarmMarksTest, AClockThatIsSetBackMakesNoShelfLonger) {
  Set(kBattery, true);
  book_.Shelve({"battery_error", utime_ + kHour, E::SEVERITY_ERROR});
  book_.Tick(utime_ - AlarmShelves::kLongestUs);
  EXPECT_EQ(Message().entries[0].state, E::STATE_LIVE);
}

TEST_F(AlarmMarksTest, WhatGoesOnItsShelfStaysNot) {
  Set(kBattery, true);
  Set(kBattery, false);
  book_.Shelve({"battery_error", utime_ + kHour, E::SEVERITY_ERROR});
  EXPECT_EQ(Message().n, 0);
  Set(kBattery, true);
  EXPECT_EQ(Message().entries[0].state, E::STATE_SHELVED);
  Set(kBattery, false);
  EXPECT_EQ(Message().n, 0);
  book_.Unshelve("battery_error");
  Set(kBattery, true);
  EXPECT_EQ(Message().entries[0].state, E::STATE_LIVE);
}

TEST_F(AlarmMarksTest, ARestartedDriverTakesAnAlarmThatComesSoonForTheSame) {
  book_.AcknowledgeAgain("battery_error", utime_ + 100);
  book_.AcknowledgeAgain("battery_alarm", utime_ + 100);
  EXPECT_EQ(book_.Acknowledged().size(), 2);
  Set(kBattery, true);
  EXPECT_TRUE(book_.Look("battery_error").acknowledged);
  book_.Tick(utime_ + 200);
  EXPECT_EQ(book_.Acknowledged(), std::vector<std::string>{"battery_error"});
  Set(kLow, true);
  EXPECT_FALSE(book_.Look("battery_alarm").acknowledged);  // too late: another one
}

TEST_F(AlarmMarksTest, ItIsKnownByThenTooWhenItIsHereAlready) {
  Set(kBattery, true);
  book_.AcknowledgeAgain("battery_error", utime_ + 100);
  EXPECT_TRUE(book_.Look("battery_error").acknowledged);
  EXPECT_EQ(book_.Acknowledged().size(), 1);
}

}  // namespace
}  // namespace axlecast
