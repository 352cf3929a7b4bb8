#include "drivers/runtime/axis/device_publisher.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/alarm/runtime_alarms.h"
#include "drivers/runtime/axis/channel_fixture.h"

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
  DevicePublisherContext context{kBoot, &time_, &sink_, {}, false};
  context.on_outcome = [&](const std::string& device, const CommandId&, const Outcome& outcome) {
    heard = device + ": " + outcome.text;
  };
  channel_.emplace(device_.bus, device_.config, context);
  Outcome outcome;
  outcome.text = "done";
  channel_->OnOutcome(CommandId{}, outcome);
  EXPECT_EQ(heard, "axis1: done");
}

}  // namespace
}  // namespace axlecast
