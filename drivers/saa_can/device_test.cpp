// One encoder, or several, on a simulated bus in virtual time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "drivers/saa_can/bus_test_support.h"
#include "tests/support/golden_file.h"

namespace axlecast::saa_can {
namespace {

using testing::IsEmpty;

constexpr MonoNs kLate = 500 * kMillisecond;  // late_us as it is without the key

TEST(SaaCanCyclic, IsStartedAndHeard) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 215.32}");
  bus.Run(10 * kSecond);
  ASSERT_GE(bus.frames->sent().size(), 1U);
  EXPECT_EQ(bus.frames->sent()[0].id, 0x220U);
  EXPECT_EQ(bus.frames->Sent(0x220, 0x01), 1) << "started once";
  // 10 s of 106.4 ms, beside what came at switching on and at the start.
  EXPECT_NEAR(static_cast<double>(bus.output().samples.size()), 94 + 2, 2);
  EXPECT_THAT(bus.output().errors, IsEmpty()) << "106.4 ms is not silence";
  EXPECT_EQ(bus.output().samples.back().counts, 9799);
  EXPECT_FALSE(bus.output().samples.back().has_turns);
}

// 5.4.1 (1): the six frames of the manual's log at their own times, 106.4 ms apart where 100 ms is set: six positions,
// and no silence. An encoder that then stops is silent three periods later.
TEST(SaaCanCyclic, TheManualsLogIsSlowerThanItsSettingAndNoSilence) {
  SimulatedBus bus("a: {bits: 14, node: 0xff, start: false, latency_us: 0}", "a: {power: off}", kReal);
  bus.Run(kMillisecond);
  double last_ms = 0;
  for (const GoldenRow& row : GoldenRows(__FILE__, "log_times.txt", 2)) {
    const double ms = std::stod(row.columns[1]);
    if (last_ms > 0) bus.Run(std::llround((ms - last_ms) * 1e6) - kMillisecond);
    last_ms = ms;
    bus.frames->Inject({.id = 0x1FF, .data = {0x02, 0x2B, 0, 0, 0, 0, 0, 0}});
    bus.Run(kMillisecond);
  }
  ASSERT_EQ(bus.output().samples.size(), 6U);
  EXPECT_THAT(bus.output().errors, IsEmpty());
  EXPECT_EQ(bus.output().samples.back().counts, 0x2B02);
  const MonoNs between = bus.output().samples[5].at.last - bus.output().samples[4].at.last;
  EXPECT_NEAR(static_cast<double>(between) / 1e6, 106.4, 0.05);
  bus.Run(298 * kMillisecond);
  EXPECT_THAT(bus.output().errors, IsEmpty());
  bus.Run(3 * kMillisecond);
  EXPECT_EQ(bus.Errors(ErrorKind::kSilent), 1);
}

TEST(SaaCanCyclic, WithoutStartItIsOnlyHeard) {
  SimulatedBus bus("a: {bits: 14, start: false}");
  bus.Run(5 * kSecond);
  EXPECT_THAT(bus.frames->sent(), IsEmpty());
  EXPECT_EQ(bus.output().samples.size(), 1U) << "what it sends when it is switched on";
}

TEST(SaaCanCyclic, TheRateIsSetOnlyWhenTheFileSaysSo) {
  SimulatedBus left("a: {bits: 14, period_ms: 20}");
  left.Run(kSecond);
  EXPECT_EQ(left.frames->Sent(0x220, 0x31), 0);
  SimulatedBus set("a: {bits: 14, period_ms: 20, set_period: true}");
  set.Run(10 * kSecond);
  ASSERT_GE(set.frames->sent().size(), 2U);
  EXPECT_EQ(Bytes(set.frames->sent()[0].data)[0], 0x31);
  EXPECT_EQ(Bytes(set.frames->sent()[0].data)[2], 50);  // TT times a second
  EXPECT_EQ(set.frames->Sent(0x220, 0x31), 1);
  EXPECT_NEAR(static_cast<double>(set.output().samples.size()), 10'000 / 21.28, 10);
  EXPECT_EQ(set.Errors(ErrorKind::kBusy), 0);
}

TEST(SaaCanCyclic, SilenceIsCountedOnceAndItIsStartedAgain) {
  SimulatedBus bus("a: {bits: 14}");
  bus.Run(2 * kSecond);
  bus.Set("a", "power", "off");
  bus.Run(5 * kSecond);
  EXPECT_EQ(bus.Errors(ErrorKind::kSilent), 1);
  bus.Set("a", "power", "on");
  bus.output().samples.clear();
  bus.Run(5 * kSecond);
  EXPECT_GT(bus.output().samples.size(), 30U);
  EXPECT_EQ(bus.Errors(ErrorKind::kSilent), 1);
}

// No node acknowledges: one frame waits, and few follow.
TEST(SaaCanCyclic, AnAbsentEncoderDoesNotFillTheQueue) {
  SimulatedBus bus("a: {bits: 14}", "a: {power: off}");
  bus.Run(10 * kSecond);
  EXPECT_LE(bus.frames->sent().size(), 11U);
  SimulatedBus single("a: {bits: 14, mode: single}", "a: {power: off}");
  single.Run(10 * kSecond);
  EXPECT_LE(single.frames->sent().size(), 11U);
  EXPECT_GE(single.Errors(ErrorKind::kTimeout), 5);
}

TEST(SaaCanCyclic, AtAnotherBitRateNothingIsHeard) {
  SimulatedBus bus("a: {bits: 14}", "", kSimulated, 500'000);
  bus.Run(3 * kSecond);
  EXPECT_THAT(bus.output().samples, IsEmpty());
  EXPECT_GT(std::stoi(bus.State("a", "unheard")), 0);
}

TEST(SaaCanSingle, EachSlotAsksOnce) {
  SimulatedBus bus("a: {bits: 17, mode: single}", "a: {start_deg: 90}", "simulate: true, poll_hz: 100, ");
  bus.Run(kLate);
  EXPECT_THAT(bus.frames->sent(), IsEmpty()) << "answers to an earlier process may come";
  bus.Run(2 * kSecond);
  EXPECT_NEAR(static_cast<double>(bus.output().samples.size()), 200, 3);
  EXPECT_EQ(bus.frames->Sent(0x220, 0x01), 1) << "started first";
  EXPECT_NEAR(bus.frames->Sent(0x220, 0x80), 199, 3);
  EXPECT_THAT(bus.output().errors, IsEmpty());
  EXPECT_EQ(bus.output().samples.back().counts, 1 << 15);
}

// It was sampled after its request, and nothing else is asked for before.
TEST(SaaCanSingle, ALatePositionIsATimeoutAndAReading) {
  SimulatedBus bus("a: {bits: 14, mode: single, timeout_us: 5000}", "a: {reply_us: 8000}",
                   "simulate: true, poll_hz: 50, ");
  bus.Run(kSecond);
  EXPECT_GE(bus.Errors(ErrorKind::kTimeout), 10);
  ASSERT_GE(bus.output().samples.size(), 10U);
  for (const Sample& sample : bus.output().samples) {
    EXPECT_GE(sample.at.last - sample.at.first, 8 * kMillisecond);
  }
}

TEST(SaaCanSingle, NeverTwoRequestsAtOnce) {
  SimulatedBus bus("a: {bits: 14, mode: single}", "a: {reply_us: 8000}", "simulate: true, poll_hz: 900, ");
  bus.Run(kLate + kSecond);
  EXPECT_EQ(bus.Errors(ErrorKind::kTimeout), 0);
  EXPECT_LE(bus.frames->sent().size(), bus.output().samples.size() + 1);
  EXPECT_NEAR(bus.frames->Sent(0x220, 0x80), 120, 15) << "8 ms each";
}

// Nor when positions come that nobody asked for: each would let one more request out.
TEST(SaaCanSingle, AnEncoderThatSendsByItselfIsNotAskedMoreOften) {
  SimulatedBus bus("a: {bits: 14, mode: single}", "a: {reply_us: 8000, cyclic: on, period_ms: 10}",
                   "simulate: true, poll_hz: 900, ");
  bus.Run(10 * kSecond);
  EXPECT_LT(bus.frames->sent().size(), 1'400U);
}

TEST(SaaCanDevice, SeveralOnOneBusEachWithItsOwnFrames) {
  SimulatedBus bus(
      "a: {bits: 14}, b: {bits: 16, node: 0x21, period_ms: 20}, c: {bits: 24, node: 0xff, mode: single}",
      "a: {start_deg: 90}, b: {start_deg: 180}, c: {start_deg: 270}", "simulate: true, poll_hz: 50, ");
  bus.Run(kLate + 5 * kSecond);
  EXPECT_EQ(bus.outputs["a"].samples.back().counts, 1 << 12);
  EXPECT_EQ(bus.outputs["b"].samples.back().counts, 1 << 15);
  EXPECT_EQ(bus.outputs["c"].samples.back().counts, 3 << 22);
  EXPECT_NEAR(static_cast<double>(bus.outputs["c"].samples.size()), 250, 5);
  for (const auto& [name, output] : bus.outputs) EXPECT_THAT(output.errors, IsEmpty()) << name;
}

// Kernel stamp less the frame's time on the wire; the earliest as much earlier as stuff bits and latency_us allow.
TEST(SaaCanDevice, TheInstantIsTheKernelsStampLessTheFrame) {
  SimulatedBus bus("a: {bits: 14, latency_us: 3000}", "a: {}", kReal);
  bus.Run(kSecond);
  bus.output().samples.clear();
  const MonoNs now = bus.clock.Now();
  bus.frames->Inject({.id = 0x120, .data = {0x47, 0x26, 0, 0, 0, 0, 0, 0}});
  bus.Run(kMillisecond);
  ASSERT_EQ(bus.output().samples.size(), 1U);
  const Sample& sample = bus.output().samples[0];
  EXPECT_EQ(sample.counts, 9799);
  EXPECT_EQ(sample.at.last, now - 428 * kMicrosecond);
  EXPECT_EQ(sample.at.first, now - 540 * kMicrosecond - 3'000 * kMicrosecond);
}

TEST(SaaCanDevice, DamagedPositionsAreErrorsByKind) {
  SimulatedBus bus("a: {bits: 14}");
  bus.Run(kSecond);
  bus.output().samples.clear();
  bus.frames->Inject({.id = 0x120, .data = {0x47}});
  bus.frames->Inject({.id = 0x120, .data = {0x00, 0x40}});
  bus.frames->Inject({.id = 0x121, .data = {0x00, 0x40}});
  bus.frames->Inject({.id = 0x120 | kCanExtended, .data = {0x00, 0x40}});
  bus.frames->Inject({.id = 0x20000004, .data = {0, 1, 0, 0, 0, 0, 0, 0}});
  bus.Run(5 * kMillisecond);
  EXPECT_EQ(bus.Errors(ErrorKind::kShort), 1);
  EXPECT_EQ(bus.Errors(ErrorKind::kRange), 1);
  EXPECT_EQ(bus.output().errors.size(), 2U);
  EXPECT_THAT(bus.output().samples, IsEmpty());
}

TEST(SaaCanDevice, AFullQueueIsCountedAndTriedAgainLater) {
  SimulatedBus bus("a: {bits: 14, mode: single}", "", "simulate: true, poll_hz: 900, ");
  bus.frames->FillQueue(true);
  bus.Run(kLate + kSecond);
  EXPECT_NEAR(bus.Errors(ErrorKind::kIo), 10, 2);
  bus.frames->FillQueue(false);
  bus.Run(kSecond);
  EXPECT_GT(bus.output().samples.size(), 100U);
}

// ---- a reply and a position look alike ----

const CanFrame kForeignZero = {.id = 0x220, .data = {0x20, 0x20, 0, 0, 0, 0, 0, 0}};
const CanFrame kZeroReply = {.id = 0x120, .data = {0x20, 0, 0, 0, 0, 0, 0, 0}};
const CanFrame kDirectionReply = {.id = 0x120, .data = {0x22, 0, 0, 0, 0, 0, 0, 0}};

TEST(SaaCanAmbiguity, WithoutACommandItIsAPosition) {
  SimulatedBus bus("a: {bits: 14}");
  bus.Run(kSecond);
  bus.output().samples.clear();
  bus.frames->Inject(kZeroReply);
  bus.frames->Inject(kDirectionReply);
  bus.Run(kMillisecond);
  ASSERT_EQ(bus.output().samples.size(), 2U);
  EXPECT_EQ(bus.output().samples[0].counts, 0x20);
  EXPECT_EQ(bus.output().samples[1].counts, 0x22);
}

TEST(SaaCanAmbiguity, TheReplyToAnOwnCommandIsNeverAPosition) {
  SimulatedBus bus("a: {bits: 14, period_ms: 10, set_period: true}", "a: {start_deg: 90}");
  bus.Run(2 * kSecond);  // set_period was acknowledged
  EXPECT_EQ(bus.Do("zero").state, CommandState::kSucceeded);
  EXPECT_EQ(bus.State("a", "replies"), "2");
  for (const Sample& sample : bus.output().samples) EXPECT_TRUE(sample.counts == 4'096 || sample.counts == 0);
  EXPECT_EQ(bus.Errors(ErrorKind::kBusy), 0);
}

// The reply that another master's command brings, and two positions that look like it: none is published, and those
// beyond the first are counted.
TEST(SaaCanAmbiguity, WhatCouldBeEitherIsWithheldAndCounted) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 90}");
  bus.Run(kSecond);
  bus.output().samples.clear();
  bus.frames->Inject(kForeignZero);
  for (int i = 0; i < 3; ++i) bus.frames->Inject(kZeroReply);
  bus.frames->Inject(kDirectionReply);  // of no command: a position
  bus.Run(kMillisecond);
  ASSERT_EQ(bus.output().samples.size(), 1U);
  EXPECT_EQ(bus.output().samples[0].counts, 0x22);
  EXPECT_EQ(bus.Errors(ErrorKind::kBusy), 2);
  // The time for it is over.
  bus.Run(kSecond);
  bus.output().samples.clear();
  bus.frames->Inject(kZeroReply);
  bus.Run(kMillisecond);
  EXPECT_EQ(bus.output().samples.size(), 1U);
}

TEST(SaaCanAmbiguity, AWithheldPositionIsASignOfLife) {
  SimulatedBus bus("a: {bits: 14, period_ms: 100, reply_ms: 10000}", "a: {start_deg: 0.71, noise_counts: 0}");
  bus.Run(kSecond);
  ASSERT_EQ(bus.output().samples.back().counts, 0x20);
  bus.frames->Inject(kForeignZero);
  bus.Run(5 * kSecond);
  EXPECT_EQ(bus.Errors(ErrorKind::kSilent), 0);
  EXPECT_GT(bus.Errors(ErrorKind::kBusy), 40);
}

// 17 bits and more: the following bytes usually distinguish them.
TEST(SaaCanAmbiguity, LongerPositionsAreTakenWhereTheyDiffer) {
  SimulatedBus bus("a: {bits: 24}");
  bus.Run(kSecond);
  bus.output().samples.clear();
  bus.frames->Inject(kForeignZero);
  bus.frames->Inject({.id = 0x120, .data = {0x20, 0x00, 0x05, 0, 0, 0, 0, 0}});
  bus.Run(kMillisecond);
  ASSERT_EQ(bus.output().samples.size(), 1U);
  EXPECT_EQ(bus.output().samples[0].counts, 0x050020);
}

TEST(SaaCanAmbiguity, ACommandOfAnotherMasterIsAJumpToo) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 90}");
  bus.Run(kSecond);
  bus.frames->Inject(kForeignZero);
  bus.Run(kSecond);
  EXPECT_EQ(bus.output().jumps, 1);
  EXPECT_FALSE(bus.output().datum_changing);
  EXPECT_EQ(bus.output().nv_writes, 1);
}

}  // namespace
}  // namespace axlecast::saa_can
