#include "core/alarm/alarm_table.h"

#include <gtest/gtest.h>
#include <cstring>

#include "core/alarm/alarm_codes.h"

namespace axlecast {
namespace {

constexpr AlarmSpec kBattery = {6, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_ERROR, "battery_error",
                                "Replace the battery."};
constexpr AlarmSpec kBatteryLow = {7, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_WARNING,
                                   "battery_alarm", "Replace the battery soon."};

class AlarmBookTest : public testing::Test {
 protected:
  const alarm_t& Message(std::int64_t utime = 1'000) {
    book_.Write(message_, utime);
    return message_;
  }
  AlarmTable book_;
  alarm_t message_{};
};

TEST_F(AlarmBookTest, WorstFirst) {
  book_.Set(kBatteryLow, AlarmState::kLive, 10);
  book_.Set(kBattery, AlarmState::kDeviceLatched, 20);
  const alarm_t& message = Message();
  ASSERT_EQ(message.n, 2);
  EXPECT_EQ(message.total, 2);
  EXPECT_EQ(message.entries[0].name, "battery_error");
  EXPECT_EQ(message.entries[0].state, alarm_entry_t::STATE_DEVICE_LATCHED);
  EXPECT_EQ(message.entries[1].name, "battery_alarm");
  EXPECT_EQ(message.entries[1].state, alarm_entry_t::STATE_LIVE);
}

TEST_F(AlarmBookTest, RevisionChangesWithTheSetOnly) {
  book_.Set(kBattery, AlarmState::kAbsent, 10);
  EXPECT_EQ(book_.revision(), 0);
  book_.Set(kBattery, AlarmState::kLive, 10);
  EXPECT_EQ(book_.revision(), 1);
  book_.Set(kBattery, AlarmState::kLive, 11);
  EXPECT_EQ(book_.revision(), 1);
  book_.Set(kBattery, AlarmState::kDeviceLatched, 12);
  EXPECT_EQ(book_.revision(), 2);
  book_.Set(kBattery, AlarmState::kAbsent, 13);
  EXPECT_EQ(book_.revision(), 3);
  EXPECT_EQ(Message().n, 0);
  EXPECT_EQ(Message().revision, 3);
}

TEST_F(AlarmBookTest, FirstLastAndCount) {
  book_.Set(kBattery, AlarmState::kLive, 10);
  book_.Set(kBattery, AlarmState::kAbsent, 20);
  book_.Set(kBattery, AlarmState::kLive, 30);
  EXPECT_EQ(Message(40).entries[0].first_utime, 30);
  EXPECT_EQ(Message(40).entries[0].last_utime, 40);  // live: it is seen now
  EXPECT_EQ(Message(41).entries[0].last_utime, 41);
  EXPECT_EQ(Message(41).entries[0].count, 2);
  book_.Set(kBattery, AlarmState::kDeviceLatched, 50);
  EXPECT_EQ(Message(60).entries[0].last_utime, 50);
  EXPECT_EQ(Message(60).entries[0].first_utime, 30);
}

TEST_F(AlarmBookTest, OfflineMakesTheDevicesAlarmsUnknownAndClearsNone) {
  book_.Set(kBattery, AlarmState::kDeviceLatched, 10);
  book_.Set(runtime_alarms::kReferenceLost, AlarmState::kDriverLatched, 10);
  const std::int64_t revision = book_.revision();
  book_.SetOffline(true);
  EXPECT_EQ(book_.revision(), revision + 1);
  ASSERT_EQ(Message().n, 2);
  for (const alarm_entry_t& entry : Message().entries) {
    EXPECT_EQ(entry.state, entry.source == alarm_entry_t::SOURCE_DEVICE ? alarm_entry_t::STATE_UNKNOWN
                                                                        : alarm_entry_t::STATE_DRIVER_LATCHED);
  }
  EXPECT_EQ(Message(99).entries[0].last_utime, 10);
  book_.SetOffline(false);
  EXPECT_EQ(Message().entries[0].source == alarm_entry_t::SOURCE_DEVICE ? Message().entries[0].state
                                                                        : Message().entries[1].state,
            alarm_entry_t::STATE_DEVICE_LATCHED);
}

TEST_F(AlarmBookTest, WhatTheDeviceSaysAfterwardsCounts) {
  book_.Set(kBattery, AlarmState::kLive, 10);
  book_.SetOffline(true);
  book_.Set(kBattery, AlarmState::kAbsent, 20);
  EXPECT_EQ(Message().n, 0);
  book_.SetOffline(false);
  EXPECT_EQ(Message().n, 0);
}

TEST_F(AlarmBookTest, EightFitAndTheTotalTellsTheRest) {
  const std::string name(40, 'n');
  const std::string action(200, 'a');
  for (std::int32_t code = 0; code < 12; ++code) {
    const AlarmSpec alarm = {code, alarm_entry_t::SOURCE_DEVICE, static_cast<std::uint8_t>(code % 4), name.c_str(),
                             action.c_str()};
    book_.Set(alarm, AlarmState::kLive, code);
  }
  alarm_t& message = message_;
  message.device = std::string(24, 'd');
  book_.Write(message, 100);
  EXPECT_EQ(message.total, 12);
  ASSERT_EQ(message.n, 8);
  for (std::size_t i = 1; i < 8; ++i) EXPECT_LE(message.entries[i].severity, message.entries[i - 1].severity);
  EXPECT_EQ(message.entries[0].code, 11);  // the newest of the worst
  EXPECT_EQ(message.entries[0].name.size(), 24U);
  EXPECT_EQ(message.entries[0].action.size(), 80U);
  EXPECT_LE(message.getEncodedSize(), 1'400);
}

TEST(RuntimeAlarms, FitTheirMessage) {
  using namespace runtime_alarms;
  for (const AlarmSpec& alarm : {kDeviceOffline, kReferenceLost, kImplausibleBurst, kClockStepped, kPositionJumped,
                                 kTurnsPassedEnd, kLinkDown, kDuplicateDriver}) {
    EXPECT_LE(std::strlen(alarm.name), 24U) << alarm.name;
    EXPECT_LE(std::strlen(alarm.action), 80U) << alarm.name;
  }
}

}  // namespace

}  // namespace axlecast
