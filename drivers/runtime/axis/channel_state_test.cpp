#include <gtest/gtest.h>

#include <algorithm>

#include "core/alarm/runtime_alarms.h"
#include "drivers/runtime/axis/channel_fixture.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = TestDevice::kTurn;
constexpr AlarmSpec kBattery = {6, alarm_entry_t::SOURCE_DEVICE, alarm_entry_t::SEVERITY_ERROR, "battery_error",
                                "Replace the battery."};

TEST_F(ChannelTest, DeviceAndAlarmComeOnceASecond) {
  Make();
  Read(0, 10'000);
  EXPECT_NEAR(static_cast<double>(Infos().size()), 11, 2);
  EXPECT_NEAR(static_cast<double>(Alarms().size()), 10, 1);
  for (std::size_t i = 0; i < Infos().size(); ++i) EXPECT_EQ(Infos()[i].seq, static_cast<std::int64_t>(i));
  for (std::size_t i = 0; i < Alarms().size(); ++i) EXPECT_EQ(Alarms()[i].seq, static_cast<std::int64_t>(i));
  EXPECT_EQ(Alarms().back().n, 0);
  EXPECT_EQ(Alarms().back().device, "axis1");
}

TEST_F(ChannelTest, DeviceTellsTheConfiguration) {
  const Family family;
  device_.bus.family = &family;
  device_.config.unit = position_t::UNIT_MM;
  device_.config.per_turn = 5;
  device_.config.ratio_den = 3;
  device_.config.direction = -1;
  device_.config.modulo = 100;
  device_.config.config_hash = 4711;
  device_.config.datum_counts = 12;
  device_.config.publish_hz = 50;
  Make();
  channel_->OnIdentity(17, "S123", "1.0");
  channel_->OnNonVolatileWrite();
  Read(0, 2'000);
  const device_info_t info = Infos().back();
  EXPECT_EQ(info.device, "axis1");
  EXPECT_EQ(info.bus, "rs485-0");
  EXPECT_EQ(info.model, "ts5669n127");
  EXPECT_EQ(info.serial, "S123");
  EXPECT_EQ(info.firmware, "1.0");
  EXPECT_EQ(info.identity, 17);
  EXPECT_EQ(info.config_hash, 4711);
  EXPECT_EQ(info.counts_per_turn, kTurn);
  EXPECT_EQ(info.turns_range, 65'536);
  EXPECT_EQ(info.ratio_den, 3);
  EXPECT_EQ(info.per_turn, 5);
  EXPECT_EQ(info.direction, -1);
  EXPECT_EQ(info.unit, position_t::UNIT_MM);
  EXPECT_EQ(info.modulo, 100);
  EXPECT_EQ(info.datum_counts, 12);
  EXPECT_EQ(info.poll_us, 1'000);
  EXPECT_EQ(info.publish_us, 20'000);
  EXPECT_EQ(info.max_age_us, 60'000);
  EXPECT_EQ(info.nv_writes, 1);
  EXPECT_EQ(info.state, device_info_t::STATE_ONLINE);
  EXPECT_GE(info.good, 1'000);
  EXPECT_NEAR(static_cast<double>(info.last_good_utime), static_cast<double>(info.utime), 1'001);
  EXPECT_NE(std::find(info.operations.begin(), info.operations.end(), "set_datum"), info.operations.end());
  EXPECT_EQ(std::find(info.operations.begin(), info.operations.end(), "mark_reference_lost"),
            info.operations.end());
}

TEST_F(ChannelTest, WithoutPositionsThereIsNoDatumToSet) {
  Family family;
  family.has_position = false;
  device_.bus.family = &family;
  Make();
  channel_->OnNonVolatileWrite();
  Read(0, 2'000);
  EXPECT_EQ(Infos().back().operations,
            (std::vector<std::string>{"acknowledge_alarm", "shelve_alarm", "unshelve_alarm"}));
}

TEST_F(ChannelTest, AFullDeviceMessageFitsOneDatagram) {
  static const std::string name(24, 'n');
  const std::vector<OperationSpec> many(30, OperationSpec{.name = name, .help = "help"});
  Family family;
  family.name = name;
  family.operations = many;
  device_.bus.family = &family;
  device_.bus.name = name;
  device_.config.model = name;
  Make();
  const std::string text(500, 't');
  channel_->OnIdentity(1, text, text);
  channel_->OnLink(false, text, t_);
  t_ += kSecond;
  channel_->Tick(t_);
  ASSERT_FALSE(Infos().empty());
  EXPECT_EQ(Infos().back().n_operations, 24);
  EXPECT_EQ(Infos().back().reason.size(), 120U);
  EXPECT_LE(Infos().back().getEncodedSize(), 1'400);
}

TEST_F(ChannelTest, OfflineKeepsTheDevicesAlarmsAsUnknown) {
  Make();
  Read(0, 10);
  channel_->OnAlarm(kBattery, AlarmState::kDeviceLatched, t_);
  Read(0, 50);
  EXPECT_EQ(Alarm("battery_error")->state, alarm_entry_t::STATE_DEVICE_LATCHED);
  EXPECT_EQ(Infos().back().state, device_info_t::STATE_DEGRADED);
  EXPECT_EQ(Infos().back().reason, "alarm battery_error");
  Fail(300);
  EXPECT_EQ(Infos().back().state, device_info_t::STATE_OFFLINE);
  EXPECT_EQ(Alarm("battery_error")->state, alarm_entry_t::STATE_UNKNOWN);
  EXPECT_EQ(Alarm("device_offline")->state, alarm_entry_t::STATE_LIVE);
  Read(0, 50);
  EXPECT_EQ(Alarm("battery_error")->state, alarm_entry_t::STATE_DEVICE_LATCHED);
  EXPECT_FALSE(Alarm("device_offline").has_value());
  EXPECT_EQ(Infos().back().state, device_info_t::STATE_DEGRADED);
  channel_->OnAlarm(kBattery, AlarmState::kAbsent, t_);
  Read(0, 50);
  EXPECT_EQ(Infos().back().state, device_info_t::STATE_ONLINE);
}

TEST_F(ChannelTest, AChangeIsToldWithin100Milliseconds) {
  Make();
  Read(0, 1'500);
  const std::size_t before = Infos().size();
  channel_->OnLink(false, "/dev/ttyUSB0 is gone: plug the adapter in again", t_);
  for (int i = 0; i < 100; ++i) Pass();
  ASSERT_GT(Infos().size(), before);
  EXPECT_EQ(Infos().back().reason, "/dev/ttyUSB0 is gone: plug the adapter in again");
  EXPECT_TRUE(Alarm("link_down").has_value());
  channel_->OnLink(true, "", t_);
  Read(0, 150);
  EXPECT_FALSE(Alarm("link_down").has_value());
  EXPECT_EQ(Infos().back().state, device_info_t::STATE_ONLINE);
}

TEST_F(ChannelTest, FlappingStatesDoNotFlood) {
  Make();
  Read(0, 100);
  sink_.Clear();
  for (int i = 0; i < 1'000; ++i) {
    channel_->OnAlarm(kBattery, i % 2 == 0 ? AlarmState::kLive : AlarmState::kAbsent, t_);
    Read(0);
  }
  EXPECT_LE(Infos().size(), 51U);
  EXPECT_LE(Alarms().size(), 51U);
}

TEST_F(ChannelTest, ReferenceLostIsAnAlarmUntilADatumIsSet) {
  Make();
  Read(0, 100);
  channel_->SetDatum(0, UtcNow());
  channel_->OnReferenceLost();
  Read(0, 100);
  EXPECT_EQ(Alarm("reference_lost")->state, alarm_entry_t::STATE_DRIVER_LATCHED);
  EXPECT_EQ(Infos().back().reference_lost, 1);
  EXPECT_TRUE(channel_->summary().reference_lost);
  EXPECT_EQ(Positions().back().flags & position_t::FLAG_REFERENCED, 0);
  channel_->SetDatum(5, UtcNow() - 10'000'000);  // of before the loss
  Read(0, 100);
  EXPECT_TRUE(channel_->summary().reference_lost);
  channel_->SetDatum(6, UtcNow());
  Read(0, 100);
  EXPECT_FALSE(Alarm("reference_lost").has_value());
  EXPECT_NE(Positions().back().flags & position_t::FLAG_REFERENCED, 0);
}

TEST_F(ChannelTest, AWildStampOfADatumIsNoFreshOne) {
  Make();
  Read(0, 100);
  channel_->OnReferenceLost();
  for (const std::int64_t utime : {INT64_MIN, std::int64_t{0}, INT64_MAX}) {
    channel_->SetDatum(1, utime);
    EXPECT_TRUE(channel_->summary().reference_lost);
  }
}

TEST_F(ChannelTest, AJumpThatNobodyAnnouncedIsAnAlarm) {
  Make();
  Read(0, 100);
  Read(900 * kTurn, 100);
  EXPECT_TRUE(Alarm("position_jumped").has_value());
  EXPECT_EQ(Infos().back().datum_epoch, 1);
  Read(900 * kTurn, 61'000);
  EXPECT_FALSE(Alarm("position_jumped").has_value());
}

TEST_F(ChannelTest, PassingTheEndIsAnAlarm) {
  device_.config.turns = TurnsMode::kUnsigned;
  Make();
  const std::int64_t end = TestDevice::kRange * kTurn;
  Read(end - 100, 100);
  Read(end + 100, 100);
  EXPECT_EQ(Positions().back().counts, end + 100);
  EXPECT_TRUE(Alarm("turns_passed_end").has_value());
  Read(end - 100, 100);
  EXPECT_FALSE(Alarm("turns_passed_end").has_value());
}

TEST_F(ChannelTest, ABurstOfImplausibleReadingsIsAnAlarm) {
  Make();
  Read(0, 2'000);
  for (int i = 0; i < 20; ++i) {
    Read(kTurn / 2);
    Read(0, 20);
  }
  Read(0, 1'000);
  EXPECT_TRUE(Alarm("implausible_burst").has_value());
  Read(0, 3'000);
  EXPECT_FALSE(Alarm("implausible_burst").has_value());
}

TEST_F(ChannelTest, ARefusedDeviceIsOffline) {
  Make();
  channel_->OnRefused("ENID 23 instead of 17: check model in the configuration");
  Fail(100, ErrorKind::kWrongIdentity);
  EXPECT_EQ(Infos().back().state, device_info_t::STATE_OFFLINE);
  EXPECT_EQ(Infos().back().reason, "ENID 23 instead of 17: check model in the configuration");
  EXPECT_EQ(channel_->errors(ErrorKind::kWrongIdentity), 100);
}

}  // namespace
}  // namespace axlecast
