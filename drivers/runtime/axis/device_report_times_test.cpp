#include <gtest/gtest.h>

#include <algorithm>
#include <axlecast/device_info_t.hpp>

#include "core/alarm/alarm_codes.h"
#include "drivers/runtime/axis/axis_fixture.h"
#include "drivers/runtime/axis/device_publisher.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = TestDevice::kTurn;
constexpr AlarmSpec kBattery = {6, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_ERROR, "battery_error",
                                "Replace the battery."};

TEST_F(ChannelTest, AJumpIsShownForAMinute) {
  Make();
  Read(0, 100);
  for (int i = 0; i < 3; ++i) Read(900 * kTurn);
  const MonoNs jumped = t_ - kMillisecond + kMicrosecond;  // the end of the interval of the reading
  channel_->Tick(jumped + 60 * kSecond - 1);
  EXPECT_TRUE(Alarm("position_jumped").has_value());
  channel_->Tick(jumped + 60 * kSecond);
  channel_->Tick(jumped + 60 * kSecond + 20 * kMillisecond);
  EXPECT_FALSE(Alarm("position_jumped").has_value());
}

TEST_F(ChannelTest, AJumpIsOverExactlyAfterAMinute) {
  Make();
  Read(0, 100);
  for (int i = 0; i < 3; ++i) Read(900 * kTurn);
  const MonoNs jumped = t_ - kMillisecond + kMicrosecond;
  channel_->Tick(jumped + 60 * kSecond - 100 * kMillisecond);
  channel_->Tick(jumped + 60 * kSecond);
  EXPECT_FALSE(Alarm("position_jumped").has_value());
}

TEST_F(ChannelTest, AJumpIsReportedWithoutATick) {
  Make();
  Read(0, 100);
  sink_.Clear();
  Read(900 * kTurn, 30);
  EXPECT_TRUE(Alarm("position_jumped").has_value());
}

TEST_F(ChannelTest, AStepOfTheClockIsShownForAMinute) {
  Make();
  Read(0, 2);
  channel_->Tick(t_);
  channel_->OnClockStepped();
  const MonoNs stepped = t_;
  channel_->Tick(stepped + 60 * kSecond - 20 * kMillisecond);
  EXPECT_TRUE(Alarm("clock_stepped").has_value());
  channel_->Tick(stepped + 60 * kSecond);
  EXPECT_FALSE(Alarm("clock_stepped").has_value());
}

TEST_F(ChannelTest, UnexpectedBytesAreAnAlarmAndNoMissedReading) {
  Make();
  Read(0, 200);
  for (int i = 0; i < 30; ++i) channel_->OnError(ErrorKind::kUnexpectedBytes, {t_, t_});
  Read(0, 2'100);
  EXPECT_EQ(Positions().back().missed, 0);
  const auto alarms = Alarms();
  EXPECT_TRUE(std::any_of(alarms.begin(), alarms.end(), [](const alarm_t& alarm) {
    return std::any_of(alarm.entries.begin(), alarm.entries.end(),
                       [](const alarm_entry_t& entry) { return entry.name == "unexpected_bytes"; });
  }));
}

TEST_F(ChannelTest, MessagesAfterChangesAre20MillisecondsApart) {
  Make();
  Read(0, 2'000);
  sink_.Clear();
  t_ += 100 * kMillisecond;
  channel_->OnIdentity(1, "A", "");
  channel_->Tick(t_);
  EXPECT_EQ(Infos().size(), 1U);
  channel_->OnIdentity(2, "A", "");
  channel_->Tick(t_ + 20 * kMillisecond - 1);
  EXPECT_EQ(Infos().size(), 1U);
  channel_->Tick(t_ + 20 * kMillisecond);
  EXPECT_EQ(Infos().size(), 2U);
}

TEST_F(ChannelTest, DeviceAndAlarmHaveTheTimeAndTheBootOfTheDriver) {
  Make();
  Read(0, 100);
  channel_->Tick(t_);
  EXPECT_EQ(Infos().back().boot_id, kBoot);
  EXPECT_EQ(Alarms().back().boot_id, kBoot);
  t_ += 2 * kSecond;
  channel_->Tick(t_);
  EXPECT_EQ(Alarms().back().mono_ns, t_);
  EXPECT_EQ(Alarms().back().utime, UtcNow());
  EXPECT_EQ(Infos().back().mono_ns, t_);
}

TEST_F(ChannelTest, ChangesOfTheStateAndOfTheIdentityAreReportedTogether) {
  Make();
  Read(0, 100);
  sink_.Clear();
  channel_->OnRefused("ENID 23 instead of 17");
  channel_->OnIdentity(23, "A", "");
  channel_->Tick(t_ += 20 * kMillisecond);
  ASSERT_EQ(Infos().size(), 1U);
  EXPECT_EQ(Infos()[0].identity, 23);
  EXPECT_EQ(Infos()[0].reason, "ENID 23 instead of 17");
}

TEST_F(ChannelTest, FailuresAreReportedWithoutATick) {
  Make();
  Read(0, 2);
  for (int i = 0; i < 9; ++i) channel_->OnError(ErrorKind::kTimeout, {t_, t_ + 200 * kMillisecond});
  channel_->OnError(ErrorKind::kTimeout, {t_, t_ + 220 * kMillisecond});
  ASSERT_FALSE(Infos().empty());
  EXPECT_EQ(Infos().back().state, device_info_t::STATE_OFFLINE);
  EXPECT_EQ(Infos().back().mono_ns, t_ + 220 * kMillisecond);
}

TEST_F(ChannelTest, ALostLinkIsReportedWithoutATick) {
  Make();
  Read(0, 2);
  channel_->OnLink(false, "unplugged", t_ += kSecond);
  ASSERT_FALSE(Infos().empty());
  EXPECT_EQ(Infos().back().state, device_info_t::STATE_OFFLINE);
  EXPECT_EQ(Infos().back().mono_ns, t_);
  ASSERT_TRUE(Alarm("link_down").has_value());
  EXPECT_EQ(Alarm("link_down")->first_utime, UtcNow());
}

TEST_F(ChannelTest, AnAlarmHasTheTimeAtWhichTheDeviceReportsIt) {
  Make();
  Read(0, 2);
  channel_->OnAlarm(kBattery, AlarmState::kLive, t_ += kSecond);
  channel_->Tick(t_ + kSecond);
  ASSERT_TRUE(Alarm("battery_error").has_value());
  EXPECT_EQ(Alarm("battery_error")->first_utime, UtcNow());
}

TEST_F(ChannelTest, AShelfEndsWithATick) {
  Make();
  Read(0, 2);
  channel_->OnAlarm(kBattery, AlarmState::kLive, t_);
  channel_->alarms().Shelve({"battery_error", UtcNow() + 1'000'000, alarm_entry_t::SEVERITY_ERROR});
  channel_->Tick(t_ + 900 * kMillisecond);
  ASSERT_TRUE(Alarm("battery_error").has_value());
  EXPECT_EQ(Alarm("battery_error")->state, alarm_entry_t::STATE_SHELVED);
  channel_->Tick(t_ + 1'000 * kMillisecond);
  EXPECT_EQ(Alarm("battery_error")->state, alarm_entry_t::STATE_LIVE);
}

TEST_F(ChannelTest, ALinkThatStaysUpIsNoGap) {
  Make();
  Read(0, 10);
  sink_.Clear();
  channel_->OnLink(true, "", t_);
  Read(0);
  ASSERT_EQ(Positions().size(), 1U);
  EXPECT_EQ(Positions()[0].flags & position_t::FLAG_AFTER_GAP, 0);
}

TEST_F(ChannelTest, ADatumFromAfterTheLossRestoresTheReferenceAlsoIfItArrivesLater) {
  Make();
  Read(0, 100);
  channel_->OnReferenceLost();
  t_ += 5 * kSecond;
  Read(0, 2);
  channel_->SetDatum(6, UtcNow() - 4'000'000);
  EXPECT_FALSE(channel_->summary().reference_lost);
}

TEST_F(ChannelTest, ANewDatumIsReportedAtOnce) {
  Make();
  Read(0, 500);
  const std::size_t before = Infos().size();
  channel_->SetDatum(5, UtcNow());
  Read(0, 2);
  ASSERT_EQ(Infos().size(), before + 1);
  EXPECT_EQ(Infos().back().datum_counts, 5);
}

}  // namespace
}  // namespace axlecast
