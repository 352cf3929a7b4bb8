#include <gtest/gtest.h>
#include <algorithm>
#include <axlecast/device_info_t.hpp>
#include <cmath>

#include "core/alarm/alarm_codes.h"
#include "drivers/runtime/axis/axis_fixture.h"
#include "drivers/runtime/axis/device_publisher.h"

namespace axlecast {
namespace {

constexpr std::int64_t kTurn = TestDevice::kTurn;

TEST_F(ChannelTest, APositionHoldsWhatTheConfigurationMakesOfTheReading) {
  device_.config.unit = position_t::UNIT_MM;
  device_.config.per_turn = 5;
  device_.bus.simulate = true;
  redecoded_ = true;
  Make();
  Read(3 * kTurn + kTurn / 4, 2);
  ASSERT_EQ(Positions().size(), 1U);
  const position_t p = Positions()[0];
  const MonoNs at = t_ - kMillisecond;
  EXPECT_EQ(p.mono_ns, at);
  EXPECT_EQ(p.utime, kUtcAtZero + at / kMicrosecond);
  EXPECT_EQ(p.boot_id, kBoot);
  EXPECT_EQ(p.seq, 0);
  EXPECT_EQ(p.time_uncertainty_ns, 1'000);
  EXPECT_EQ(p.missed, 1);  // the first one waited for the second
  EXPECT_EQ(p.raw_counts, kTurn / 4);
  EXPECT_EQ(p.raw_turns, 3);
  EXPECT_EQ(p.counts_per_turn, kTurn);
  EXPECT_EQ(p.counts, 3 * kTurn + kTurn / 4);
  EXPECT_DOUBLE_EQ(p.angle_rad, M_PI / 2);
  EXPECT_DOUBLE_EQ(p.value, 16.25);
  EXPECT_EQ(p.unit, position_t::UNIT_MM);
  EXPECT_TRUE(std::isnan(p.speed_rad_s));
  EXPECT_EQ(p.flags, 0x6003);  // VALID, TURNS_VALID, SIMULATED, REDECODED
  EXPECT_EQ(p.spare[0], 0);
  EXPECT_EQ(p.spare[1], 0);
}

TEST_F(ChannelTest, SequenceNumbersHaveNoGapsAndReadingsAreDecimated) {
  device_.config.publish_hz = 100;
  Make();
  Read(0, 1'001);
  const auto positions = Positions();
  EXPECT_NEAR(static_cast<double>(positions.size()), 100, 1);
  for (std::size_t i = 0; i < positions.size(); ++i) EXPECT_EQ(positions[i].seq, static_cast<std::int64_t>(i));
  EXPECT_EQ(positions.back().missed, 0);
  EXPECT_NE(positions.back().flags & position_t::FLAG_SPEED_VALID, 0);
}

TEST_F(ChannelTest, FailedReadingsAreCountedAndTheNextGoodOneSaysSo) {
  Make();
  Read(0, 10);
  sink_.Clear();
  Fail(3, ErrorKind::kChecksum);
  channel_->OnError(ErrorKind::kUnexpectedBytes, {t_, t_});
  Read(0, 2);
  const auto positions = Positions();
  ASSERT_EQ(positions.size(), 2U);
  EXPECT_EQ(positions[0].missed, 3);
  EXPECT_NE(positions[0].flags & position_t::FLAG_AFTER_GAP, 0);
  EXPECT_EQ(positions[1].missed, 0);
  EXPECT_EQ(positions[1].flags & position_t::FLAG_AFTER_GAP, 0);
  EXPECT_EQ(channel_->errors(ErrorKind::kChecksum), 3);
  EXPECT_EQ(channel_->errors(ErrorKind::kUnexpectedBytes), 1);
}

TEST_F(ChannelTest, TheGapIsToldByTheNextMessageWhenReadingsAreDecimated) {
  device_.config.publish_hz = 100;
  Make();
  Read(0, 25);
  const std::size_t before = Positions().size();
  Fail(1);
  Read(0, 30);
  const auto positions = Positions();
  EXPECT_NE(positions.at(before).flags & position_t::FLAG_AFTER_GAP, 0);
  EXPECT_EQ(positions.at(before).missed, 1);
  EXPECT_EQ(positions.at(before + 1).flags & position_t::FLAG_AFTER_GAP, 0);
}

TEST_F(ChannelTest, ALostLineIsAGapAlthoughNoReadingFailed) {
  Make();
  Read(0, 10);
  sink_.Clear();
  channel_->OnLink(false, "unplugged", t_);
  channel_->OnLink(true, "", t_);
  Read(0, 2);
  const auto positions = Positions();
  ASSERT_EQ(positions.size(), 2U);
  EXPECT_NE(positions[0].flags & position_t::FLAG_AFTER_GAP, 0);
  EXPECT_EQ(positions[0].missed, 0);
  EXPECT_EQ(positions[1].flags & position_t::FLAG_AFTER_GAP, 0);
}

TEST_F(ChannelTest, AnImplausibleReadingIsPublishedOnceAndNotValid) {
  Make();
  Read(0, 10);
  sink_.Clear();
  Read(kTurn / 2);
  Read(0, 2);
  const auto positions = Positions();
  ASSERT_EQ(positions.size(), 3U);
  EXPECT_EQ(positions[0].flags & position_t::FLAG_VALID, 0);
  EXPECT_NE(positions[0].flags & position_t::FLAG_IMPLAUSIBLE, 0);
  EXPECT_EQ(positions[0].raw_counts, kTurn / 2);
  EXPECT_TRUE(std::isnan(positions[0].value));
  EXPECT_TRUE(std::isnan(positions[0].angle_rad));
  EXPECT_NE(positions[1].flags & position_t::FLAG_VALID, 0);
  EXPECT_NE(positions[1].flags & position_t::FLAG_AFTER_GAP, 0);
  EXPECT_EQ(channel_->errors(ErrorKind::kImplausible), 1);
}

TEST_F(ChannelTest, AnInvalidDevicePositionIsPublishedAtTenHertz) {
  Make();
  Read(0, 10);
  sink_.Clear();
  for (int i = 0; i < 1'000; ++i) {
    Sample sample = ReadingAt(t_, 0);
    sample.error = true;
    Read(sample);
  }
  EXPECT_EQ(Positions().size(), 10U);
  EXPECT_EQ(Positions().back().missed, 99);
  EXPECT_EQ(channel_->errors(ErrorKind::kDevice), 1'000);
  EXPECT_EQ(channel_->summary().state, device_info_t::STATE_DEGRADED);
  EXPECT_TRUE(std::isnan(channel_->summary().value));
}

TEST_F(ChannelTest, ClockSteppedIsSaidOnceAndRaisesAnAlarm) {
  device_.config.block = true;
  Make();
  Read(0, 80);
  sink_.Clear();
  channel_->OnClockStepped();
  Read(0, 80);
  EXPECT_NE(Positions()[0].flags & position_t::FLAG_CLOCK_STEPPED, 0);
  EXPECT_EQ(Positions()[1].flags & position_t::FLAG_CLOCK_STEPPED, 0);
  int in_blocks = 0;
  for (const auto& block : Blocks()) {
    for (const std::int32_t flags : block.flags) in_blocks += (flags & position_t::FLAG_CLOCK_STEPPED) != 0 ? 1 : 0;
  }
  EXPECT_EQ(in_blocks, 1);
  Read(0, 1'200);
  EXPECT_TRUE(Alarm("clock_stepped").has_value());
  Read(0, 61'000);
  EXPECT_FALSE(Alarm("clock_stepped").has_value());
}

TEST_F(ChannelTest, EveryReadingGoesIntoABlock) {
  device_.config.block = true;
  device_.config.publish_hz = 10;
  Make();
  for (int i = 0; i < 1'001; ++i) Read(i);
  t_ += 200 * kMillisecond;
  channel_->Tick(t_);
  std::int64_t next = 1;  // the first reading waited for the second, which is in
  std::int64_t seq = 0;
  for (const auto& block : Blocks()) {
    EXPECT_EQ(block.seq, seq++);
    EXPECT_EQ(block.missed, next == 1 ? 1 : 0);
    for (int i = 0; i < block.n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      ASSERT_EQ(block.counts[k], next);
      ASSERT_EQ(block.mono_ns + block.dt_ns[k], 1'000 * kSecond + next * kMillisecond);
      ++next;
    }
    EXPECT_DOUBLE_EQ(block.unit_per_count, 1.0 / kTurn);
  }
  EXPECT_EQ(next, 1'001);
}

TEST_F(ChannelTest, ABlockIsSentWithItsFortiethReading) {
  device_.config.block = true;
  Make();
  Read(0, 40);  // the first one waited for the second
  EXPECT_TRUE(Blocks().empty());
  Read(0);
  ASSERT_EQ(Blocks().size(), 1U);
  EXPECT_EQ(Blocks()[0].n, 40);
}

TEST_F(ChannelTest, ABlockIsSentAfter100MillisecondsWithoutAReading) {
  device_.config.block = true;
  Make();
  Read(0, 3);
  const MonoNs first = t_ - 2 * kMillisecond;
  channel_->Tick(first + 100 * kMillisecond - 1);
  EXPECT_TRUE(Blocks().empty());
  channel_->Tick(first + 100 * kMillisecond);
  ASSERT_EQ(Blocks().size(), 1U);
  EXPECT_EQ(Blocks()[0].n, 2);
}

TEST_F(ChannelTest, ADatumSplitsTheBlock) {
  device_.config.block = true;
  Make();
  Read(1'000, 11);
  channel_->SetDatum(1'000, UtcNow());
  Read(1'000, 200);
  const auto blocks = Blocks();
  ASSERT_GE(blocks.size(), 2U);
  EXPECT_EQ(blocks[0].n, 10);
  EXPECT_EQ(blocks[0].datum_epoch, 0);
  EXPECT_EQ(blocks[1].datum_epoch, 1);
  EXPECT_EQ(blocks[1].counts[0], 0);
  EXPECT_NE(blocks[1].flags[0] & position_t::FLAG_REFERENCED, 0);
}

TEST_F(ChannelTest, DatumForTheValueThatWasAskedFor) {
  device_.config.unit = position_t::UNIT_MM;
  device_.config.per_turn = 5;
  Make();
  EXPECT_EQ(channel_->DatumFor(123.456), std::nullopt);
  Read(17 * kTurn, 2);
  const auto datum = channel_->DatumFor(123.456);
  ASSERT_TRUE(datum.has_value());
  channel_->SetDatum(*datum, UtcNow());
  Read(17 * kTurn);
  EXPECT_NEAR(Positions().back().value, 123.456, 5.0 / kTurn);
  EXPECT_NEAR(channel_->summary().value, 123.456, 5.0 / kTurn);
  EXPECT_NE(Positions().back().flags & position_t::FLAG_REFERENCED, 0);
  EXPECT_EQ(channel_->summary().datum_epoch, 1);
  channel_->OnLink(false, "unplugged", t_);
  EXPECT_EQ(channel_->DatumFor(0), std::nullopt);
}

TEST_F(ChannelTest, StandstillIsKnownFromTheReadings) {
  Make();
  Read(1'000, 60);
  EXPECT_TRUE(channel_->MotionAt(t_).standstill);
  EXPECT_EQ(channel_->MotionAt(t_).counts, 1'000);
  Read(1'500, 1);
  EXPECT_FALSE(channel_->MotionAt(t_).standstill);
}

TEST_F(ChannelTest, OutcomesAreHandedOnWithTheDevicesName) {
  std::string heard;
  time_.Update(t_, UtcNow());
  DevicePublisherContext context{{.boot_id = kBoot}, &time_, &sink_, {}, false};
  context.on_outcome = [&](const std::string& device, const CommandId&, const Outcome& outcome) {
    heard = device + ": " + outcome.text;
  };
  channel_.emplace(device_.bus, device_.config, context);
  Outcome outcome;
  outcome.text = "done";
  channel_->OnOutcome(CommandId{}, outcome);
  EXPECT_EQ(heard, "axis1: done");
}

TEST_F(ChannelTest, AnOutcomeThatNothingWaitsForIsDropped) {
  Make();
  const std::size_t before = sink_.size();
  channel_->OnOutcome(CommandId{}, Outcome{});
  EXPECT_EQ(sink_.size(), before);
}

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

TEST_F(ChannelTest, AReferenceThatWasLostHasTheTimeOfItsLoss) {
  Make();
  Read(0, 100);
  channel_->OnReferenceLost();
  Read(0);
  const std::int64_t lost = UtcNow() - 999;  // the end of the interval of the reading
  Read(0, 3'000);
  ASSERT_TRUE(Alarm("reference_lost").has_value());
  EXPECT_EQ(Alarm("reference_lost")->first_utime, lost);
  EXPECT_EQ(Alarm("reference_lost")->last_utime, lost) << "the readings since then are no losses";
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

using ChannelSummaryTest = ChannelTest;

TEST_F(ChannelSummaryTest, IdentityIsWhatAPersonWouldTellTheEncoderBy) {
  Make();
  EXPECT_EQ(channel_->summary().identity, "");
  channel_->OnIdentity(17, "", "1.2");
  EXPECT_EQ(channel_->summary().identity, "17");
  channel_->OnIdentity(17, "SN0042", "1.2");
  EXPECT_EQ(channel_->summary().identity, "17 SN0042");
  channel_->OnIdentity(-1, "SN0042", "1.2");
  EXPECT_EQ(channel_->summary().identity, "SN0042");
  channel_->OnIdentity(-1, "", "1.2");
  EXPECT_EQ(channel_->summary().identity, "");
}

TEST_F(ChannelSummaryTest, PositionIsTheLastValidReadingBeforeTheDatum) {
  device_.config.direction = -1;
  Make();
  EXPECT_FALSE(channel_->summary().position);
  Read(1'000);
  EXPECT_FALSE(channel_->summary().position);  // waits for a second that agrees
  Read(1'000);
  const MonoNs last = t_ - kMillisecond;
  ASSERT_TRUE(channel_->summary().position);
  const std::int64_t counts = channel_->summary().position->counts;
  EXPECT_EQ(counts, Positions().back().counts);
  EXPECT_EQ(channel_->summary().position->unix_us, kUtcAtZero + last / kMicrosecond);
  EXPECT_FALSE(channel_->summary().datum);

  channel_->SetDatum(-300, UtcNow());
  EXPECT_EQ(channel_->summary().datum, (Reference::Datum{-300, UtcNow()}));
  EXPECT_EQ(channel_->summary().position->counts, counts);
  Sample bad = ReadingAt(t_, 5'000);
  bad.error = true;
  Read(bad);
  Fail(3);
  EXPECT_EQ(channel_->summary().position->counts, counts);
  EXPECT_EQ(channel_->summary().position->unix_us, kUtcAtZero + last / kMicrosecond);

  channel_->OnJump();
  EXPECT_FALSE(channel_->summary().position);
  EXPECT_FALSE(channel_->summary().datum);
}

TEST_F(ChannelSummaryTest, AClearedDatumIsANewEpochOnce) {
  Make();
  Read(1'000, 2);
  const std::int32_t epoch = channel_->summary().datum_epoch;
  channel_->ClearDatum();
  EXPECT_EQ(channel_->summary().datum_epoch, epoch);
  channel_->SetDatum(5, UtcNow());
  channel_->ClearDatum();
  EXPECT_EQ(channel_->summary().datum_epoch, epoch + 2);
  EXPECT_FALSE(channel_->summary().datum);
  EXPECT_EQ(*channel_->ValueWith(0), channel_->summary().value);
}

TEST_F(ChannelTest, ABlockHoldsGoodAndDoubtfulReadingsWithTheirFlags) {
  device_.config.block = true;
  device_.config.unit = position_t::UNIT_MM;
  device_.config.per_turn = 5;
  Make();
  Read(1'000, 30);
  Sample doubtful = ReadingAt(t_, 1'000);
  doubtful.error = true;
  Read(doubtful);
  Read(1'000, 100);
  ASSERT_FALSE(Blocks().empty());
  const position_block_t block = Blocks().front();
  EXPECT_EQ(block.boot_id, kBoot);
  EXPECT_EQ(block.unit, position_t::UNIT_MM);
  EXPECT_EQ(block.utime, kUtcAtZero + block.mono_ns / kMicrosecond);
  EXPECT_EQ(block.seq, 0);
  int without_valid = 0;
  int after_a_gap = 0;
  for (const std::int32_t flags : block.flags) {
    without_valid += (flags & position_t::FLAG_VALID) == 0 ? 1 : 0;
    after_a_gap += (flags & position_t::FLAG_AFTER_GAP) != 0 ? 1 : 0;
  }
  EXPECT_EQ(without_valid, 1);
  EXPECT_EQ(after_a_gap, 1) << "the reading behind the doubtful one";
  EXPECT_NE(block.flags[29] & position_t::FLAG_DEVICE_ERROR, 0);
}

TEST_F(ChannelTest, APositionHasTheStatusOfTheDeviceAndTheEpochOfItsDatum) {
  Make();
  Sample sample = ReadingAt(t_, 1'000);
  sample.device_status = 0x20;
  Read(sample);
  sample.at = ReadingAt(t_, 1'000).at;
  Read(sample);
  ASSERT_FALSE(Positions().empty());
  EXPECT_EQ(Positions().back().device_status, 0x20);
  EXPECT_EQ(Positions().back().datum_epoch, 0);
  channel_->SetDatum(500, UtcNow());
  Read(1'000);
  EXPECT_EQ(Positions().back().datum_epoch, 1);
  EXPECT_EQ(Positions().back().counts, 500);
}

// ---- gaps, ticks and turns ----

TEST_F(ChannelTest, NothingIsMissedBeforeTheFirstGoodReading) {
  Make();
  Fail(3);
  channel_->OnLink(false, "unplugged", t_);
  channel_->OnLink(true, "", t_);
  Read(0, 2);
  ASSERT_EQ(Positions().size(), 1U);
  EXPECT_EQ(Positions()[0].flags & position_t::FLAG_AFTER_GAP, 0);
  EXPECT_EQ(Positions()[0].missed, 4);
}

TEST_F(ChannelTest, APositionHasTheTickOfItsReadingOnly) {
  Make();
  channel_->OnTick(7);
  Read(0);
  channel_->OnTick(8);
  Read(0);
  Read(0);
  channel_->OnTick(10);
  Fail(1);
  Read(0);
  ASSERT_EQ(Positions().size(), 3U);
  EXPECT_EQ(Positions()[0].tick, 8);
  EXPECT_EQ(Positions()[1].tick, kNoTick);
  EXPECT_EQ(Positions()[2].tick, kNoTick) << "the reading of tick 10 failed";
}

TEST_F(ChannelTest, TheRawTurnsAreThoseThatWereReadLast) {
  Make();
  Read(3 * kTurn + 5, 2);
  Sample single = ReadingAt(t_, 3 * kTurn + 5);
  single.has_turns = false;
  single.turns = 0;
  Read(single);
  EXPECT_EQ(Positions().back().raw_turns, 3);
  EXPECT_EQ(Positions().back().raw_counts, 5);
}

TEST_F(ChannelTest, APositionOfVeryUncertainTimeStatesTheLargestUncertainty) {
  Make();
  Read(0, 2);
  Read(ReadingAt(t_, 0, 10 * kSecond));
  EXPECT_EQ(Positions().back().time_uncertainty_ns, INT32_MAX);
}

TEST_F(ChannelTest, DoubtfulReadingsOfOneRowAreCountedInTheNextMessage) {
  Make();
  Read(0, 10);
  sink_.Clear();
  for (int i = 0; i < 2; ++i) Read(kTurn / 2 + i);
  Read(0);
  const auto positions = Positions();
  ASSERT_EQ(positions.size(), 2U);
  EXPECT_EQ(positions[0].missed, 0);
  EXPECT_EQ(positions[1].missed, 1);
}

// ---- a monitor, and the summary ----

TEST_F(ChannelTest, AMonitorIsOnlineWithItsReadings) {
  Make();
  MotorReading reading;
  reading.status_at = {t_, t_ + kMillisecond};
  channel_->OnMotor(reading);
  EXPECT_EQ(channel_->summary().state, device_info_t::STATE_ONLINE);
  EXPECT_EQ(channel_->good(), 1);
  EXPECT_EQ(sink_.All<motor_health_t>("MOTOR/axis1").size(), 1U);
  TripRecord trip;
  trip.at = {t_, t_};
  channel_->OnTrip(trip);
  MotorLimits limits;
  limits.at = {t_, t_};
  channel_->OnMotorLimits(limits);
  EXPECT_EQ(sink_.All<trip_log_t>("TRIP/axis1").size(), 1U);
  EXPECT_EQ(sink_.All<motor_limits_t>("LIMITS/axis1").size(), 1U);
  channel_->Tick(t_ + 61 * kSecond);
  EXPECT_EQ(sink_.All<trip_log_t>("TRIP/axis1").size(), 2U);
  EXPECT_EQ(sink_.All<motor_limits_t>("LIMITS/axis1").size(), 2U);
}

TEST_F(ChannelTest, AReadingOfAMonitorIsReportedWithoutATick) {
  Make();
  MotorReading reading;
  reading.status_at = {t_, t_ += kSecond};
  channel_->OnMotor(reading);
  ASSERT_FALSE(Infos().empty());
  EXPECT_EQ(Infos().back().state, device_info_t::STATE_ONLINE);
  EXPECT_EQ(Infos().back().mono_ns, t_);
}

TEST_F(ChannelTest, TheTripOfAMonitorIsOfThePresent) {
  Make();
  TripRecord trip;
  trip.at = {t_, t_ + 10 * kSecond};
  channel_->OnTrip(trip);
  channel_->OnClockStepped();
  channel_->Tick(t_ + 69 * kSecond);
  EXPECT_TRUE(Alarm("clock_stepped").has_value()) << "for a minute after it was read";
}

TEST_F(ChannelTest, TheLimitsOfAMonitorAreRepeatedAMinuteAfterTheyWereRead) {
  Make();
  MotorLimits limits;
  limits.at = {t_, t_ + 30 * kSecond};
  channel_->OnMotorLimits(limits);
  channel_->Tick(t_ + 90 * kSecond - 1);
  EXPECT_EQ(sink_.All<motor_limits_t>("LIMITS/axis1").size(), 1U);
  channel_->Tick(t_ + 90 * kSecond);
  EXPECT_EQ(sink_.All<motor_limits_t>("LIMITS/axis1").size(), 2U);
}

TEST_F(ChannelSummaryTest, TheDatumOfTheFileIsNamedBesideTheOneInUse) {
  device_.config.datum_counts = 70;
  Make();
  EXPECT_EQ(channel_->summary().file_datum, (Reference::Datum{70, 0}));
  EXPECT_EQ(channel_->summary().datum, (Reference::Datum{70, 0}));
  channel_->SetDatum(5, UtcNow());
  EXPECT_EQ(channel_->summary().file_datum, (Reference::Datum{70, 0}));
  EXPECT_EQ(channel_->summary().datum->counts, 5);
}

TEST_F(ChannelTest, ADegradedDeviceHasADatumForAValueAndAStartingOneHasNot) {
  Make();
  Read(1'000, 10);
  channel_->OnAlarm(kBattery, AlarmState::kLive, t_);
  Read(1'000);
  ASSERT_EQ(channel_->summary().state, device_info_t::STATE_DEGRADED);
  EXPECT_TRUE(channel_->DatumFor(0));
  channel_->OnStarting("power-on standby");
  ASSERT_EQ(channel_->summary().state, device_info_t::STATE_STARTING);
  EXPECT_FALSE(channel_->DatumFor(0));
}

class FixedClaims final : public BaseClaims {
 public:
  [[nodiscard]] std::optional<BaseClaim> At(MonoNs mono) const override {
    return is_known ? std::optional(BaseClaim{9, mono, 0}) : std::nullopt;
  }
  bool is_known = true;
};

TEST_F(ChannelTest, TheBaseOfTheTicksIsTheOneOfThePresent) {
  FixedClaims claims;
  time_.Update(t_, UtcNow());
  channel_.emplace(device_.bus, device_.config,
                   DevicePublisherContext{{.boot_id = kBoot}, &time_, &sink_, {}, false, &claims});
  channel_->Tick(t_);
  EXPECT_EQ(Infos().back().tick_base_id, 9);
  claims.is_known = false;
  channel_->Tick(t_ += kSecond);
  EXPECT_EQ(Infos().back().tick_base_id, 0);
}

}  // namespace
}  // namespace axlecast
