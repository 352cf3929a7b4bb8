// Operations on a simulated bus in virtual time: zero, direction, rate, stop, and looking afterwards.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <axlecast/command_status_t.hpp>

#include "drivers/kit/command_runner.h"
#include "drivers/saa_can/bus_test_support.h"
#include "drivers/saa_can/family.h"

namespace axlecast::saa_can {
namespace {

using testing::HasSubstr;
using Reason = command_status_t;

constexpr const char* kPolled = "simulate: true, poll_hz: 100, ";

// ---- zero ----

TEST(SaaCanZero, IsOneFrameVerifiedByReading) {
  for (const char* device : {"a: {bits: 14}", "a: {bits: 14, mode: single}", "a: {bits: 26, period_ms: 10}"}) {
    SimulatedBus bus(device, "a: {start_deg: 123}", kPolled);
    bus.Run(kSecond);
    const Outcome outcome = bus.Do("zero");
    EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
    EXPECT_TRUE(outcome.verified);
    EXPECT_EQ(After(outcome, "single_turn"), "0");
    EXPECT_EQ(bus.frames->Sent(0x220, 0x20), 1);
    EXPECT_EQ(bus.State("a", "zeroings"), "1");
    EXPECT_EQ(bus.output().jumps, 1);
    EXPECT_EQ(bus.output().nv_writes, 1);
    EXPECT_FALSE(bus.output().datum_changing);
  }
}

TEST(SaaCanZero, AShaftThatTurnsIsRefused) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 123}");
  bus.Run(kSecond);
  bus.output().motion = {.known = true, .standstill = false, .speed_rpm = 12};
  const Outcome outcome = bus.Do("zero");
  EXPECT_EQ(outcome.state, CommandState::kRejected);
  EXPECT_EQ(outcome.reason, Reason::REASON_NOT_STANDING_STILL);
  EXPECT_EQ(bus.frames->Sent(0x220, 0x20), 0);
}

// Standstill is measured before the request, not only when the command begins.
TEST(SaaCanZero, AShaftThatBeginsToTurnIsRefused) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 123}");
  bus.Run(kSecond);
  bus.Begin("zero");
  bus.output().motion = {};
  const Outcome outcome = bus.Finish();
  EXPECT_EQ(outcome.state, CommandState::kRejected);
  EXPECT_EQ(bus.frames->Sent(0x220, 0x20), 0);
}

TEST(SaaCanZero, AFullQueueIsNothingDone) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 123}");
  bus.Run(kSecond);
  bus.frames->FillQueue(true);
  const Outcome outcome = bus.Do("zero");
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_THAT(outcome.text, HasSubstr("nothing was done"));
  EXPECT_EQ(bus.State("a", "zeroings"), "0");
  EXPECT_EQ(bus.output().jumps, 0);
}

// Queued, and acknowledged by nobody: it would act later. The encoder goes as its last position comes.
TEST(SaaCanZero, AFrameThatNobodyAcknowledgesIsInDoubt) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 123}");
  bus.Run(kSecond);
  bus.Set("a", "power", "off");
  bus.Begin("zero");
  bus.frames->Inject({.id = 0x120, .data = {0x47, 0x26, 0, 0, 0, 0, 0, 0}});
  const Outcome outcome = bus.Finish();
  EXPECT_EQ(bus.frames->Sent(0x220, 0x20), 1);
  EXPECT_EQ(outcome.state, CommandState::kIndeterminate);
  EXPECT_THAT(outcome.text, HasSubstr("still wait in the controller's queue"));
  EXPECT_THAT(outcome.text, HasSubstr("ip link set can-0 down"));
  EXPECT_TRUE(bus.output().datum_changing) << "until it is known";
  // It does act later; the jump is published then.
  bus.Set("a", "power", "on");
  bus.Run(5 * kSecond);
  EXPECT_EQ(bus.State("a", "zeroings"), "1");
  EXPECT_EQ(bus.output().jumps, 1);
  EXPECT_FALSE(bus.output().datum_changing);
}

TEST(SaaCanZero, WhatIsNotZeroAfterwardsFails) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 123, zero_error_deg: 3}");
  bus.Run(kSecond);
  const Outcome outcome = bus.Do("zero");
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_EQ(outcome.reason, Reason::REASON_READ_BACK_DIFFERS);
}

TEST(SaaCanZero, NothingHeardAfterwardsIsInDoubt) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 123}");
  bus.Run(kSecond);
  bus.Begin("zero");
  while (bus.frames->Sent(0x220, 0x20) == 0) bus.Run(kMillisecond);
  bus.Set("a", "fault", "off");
  const Outcome outcome = bus.Finish();
  EXPECT_EQ(outcome.state, CommandState::kIndeterminate);
  EXPECT_EQ(bus.State("a", "zeroings"), "1");
  bus.Set("a", "fault", "none");
  bus.Run(3 * kSecond);
  EXPECT_EQ(After(bus.Do("read_position", {{"after", "zero"}}), "finding"), "reads_as_after");
  EXPECT_EQ(bus.output().jumps, 1);
}

TEST(SaaCanZero, TheLinkLostInBetweenIsInDoubt) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 123}");
  bus.Run(kSecond);
  bus.Begin("zero");
  while (bus.frames->Sent(0x220, 0x20) == 0) bus.Run(kMillisecond);
  bus.frames->Unplug();
  EXPECT_EQ(bus.Finish().state, CommandState::kIndeterminate);
  bus.frames->Plug();
  bus.Run(5 * kSecond);
  EXPECT_EQ(bus.output().jumps, 1);
  EXPECT_FALSE(bus.output().datum_changing);
}

// ---- commands that the manual prints alike ----

TEST(SaaCanDirection, IsRefusedWithoutTheByteThatTheManualLeavesOut) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 123}");
  bus.Run(kSecond);
  const Outcome outcome = bus.Do("set_direction", {{"direction", "negative"}});
  EXPECT_EQ(outcome.state, CommandState::kRejected);
  EXPECT_THAT(outcome.text, HasSubstr("negative_byte"));
  EXPECT_EQ(bus.frames->Sent(0x220, 0x22), 0);
}

TEST(SaaCanDirection, WithTheByteItIsAcceptedButNotVerified) {
  SimulatedBus bus("a: {bits: 14, positive_byte: 0, negative_byte: 1}", "a: {start_deg: 90}");
  bus.Run(kSecond);
  const Outcome outcome = bus.Do("set_direction", {{"direction", "negative"}});
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_FALSE(outcome.verified);
  EXPECT_EQ(bus.State("a", "counting"), "negative");
  bus.Run(kSecond);
  EXPECT_EQ(bus.output().samples.back().counts, 12'288);
  EXPECT_EQ(bus.output().jumps, 1);
}

// 0x22 at 14 bits is 0.7471 degrees.
TEST(SaaCanDirection, WhereAPositionLooksLikeTheReplyItIsRefused) {
  SimulatedBus bus("a: {bits: 14, positive_byte: 0, negative_byte: 1}", "a: {start_deg: 0.75}");
  bus.Run(kSecond);
  const Outcome outcome = bus.Do("set_direction", {{"direction", "negative"}});
  EXPECT_EQ(outcome.state, CommandState::kRejected);
  EXPECT_THAT(outcome.text, HasSubstr("turn it a little"));
}

TEST(SaaCanStop, IsRefusedWithoutTheByteAndWhereTheFileWantsACyclicEncoder) {
  SimulatedBus single("a: {bits: 14, mode: single}", "", kPolled);
  single.Run(kSecond);
  EXPECT_THAT(single.Do("stop_cyclic").text, HasSubstr("stop_byte"));
  SimulatedBus cyclic("a: {bits: 14, stop_byte: 0}");
  cyclic.Run(kSecond);
  EXPECT_THAT(cyclic.Do("stop_cyclic").text, HasSubstr("mode: single first"));
}

TEST(SaaCanStop, NothingComesByItselfAnyMore) {
  SimulatedBus bus("a: {bits: 14, mode: single, stop_byte: 0}", "a: {cyclic: on}", kPolled);
  bus.Run(kSecond);
  EXPECT_EQ(bus.Do("stop_cyclic").state, CommandState::kSucceeded);
  EXPECT_EQ(bus.output().nv_writes, 1);
  EXPECT_EQ(bus.State("a", "cyclic"), "off");
}

// ---- rate ----

TEST(SaaCanPeriod, IsMeasured) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 90}");
  bus.Run(kSecond);
  const Outcome outcome = bus.Do("set_period", {{"period_ms", "20"}});
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_TRUE(outcome.verified);
  EXPECT_EQ(After(outcome, "period_ms"), "21.3");
  EXPECT_THAT(outcome.text, HasSubstr("period_ms: 20"));
  // A slower one than the file's is followed: no silence.
  EXPECT_EQ(bus.Do("set_period", {{"period_ms", "1000"}}).state, CommandState::kSucceeded);
  bus.Run(5 * kSecond);
  EXPECT_EQ(bus.Errors(ErrorKind::kSilent), 0);
  EXPECT_EQ(After(bus.Do("read_position", {{"after", "set_period period_ms=1000"}}), "finding"), "reads_as_after");
  EXPECT_EQ(After(bus.Do("read_position", {{"after", "set_period period_ms=100"}}), "finding"), "no_effect_seen");
}

TEST(SaaCanPeriod, AnEncoderThatKeepsItsOwnFails) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 90, period_factor: 3}");
  bus.Run(kSecond);
  const Outcome outcome = bus.Do("set_period", {{"period_ms", "50"}});
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_EQ(outcome.reason, Reason::REASON_READ_BACK_DIFFERS);
}

// ---- expiry ----

// Once the position was requested, or the driver listens for it, the time to begin does not matter any more.
TEST(SaaCanReadPosition, DoesNotExpireOnceItHasBegun) {
  for (const char* device : {"a: {bits: 14, mode: single}", "a: {bits: 14}"}) {
    SimulatedBus bus(device, "a: {start_deg: 90}", kPolled);
    bus.Run(kSecond);
    bus.Set("a", "fault", "off");
    bus.Begin("read_position", {}, bus.clock.Now() + 50 * kMillisecond);
    const Outcome outcome = bus.Finish();
    EXPECT_EQ(outcome.state, CommandState::kFailed) << device;
    EXPECT_THAT(outcome.text, HasSubstr("no position came in time")) << device;
  }
}

TEST(SaaCanReadPosition, ExpiresBeforeItsRequest) {
  SimulatedBus bus("a: {bits: 14, mode: single}", "a: {start_deg: 90}", kPolled);
  bus.Run(kSecond);
  bus.frames->FillQueue(true);
  bus.Run(20 * kMillisecond);
  bus.Begin("read_position", {}, bus.clock.Now() + kMillisecond);
  EXPECT_EQ(bus.Finish().state, CommandState::kExpired);
}

// What changes something must not act later than its time to begin, although it has read a position.
TEST(SaaCanZero, ExpiresAfterItsFirstReading) {
  SimulatedBus bus("a: {bits: 14, mode: single}", "a: {start_deg: 123}", kPolled);
  bus.Run(kSecond);
  bus.Set("a", "fault", "off");
  bus.Begin("zero", {}, bus.clock.Now() + 50 * kMillisecond);
  EXPECT_EQ(bus.Finish().state, CommandState::kExpired);
  EXPECT_EQ(bus.frames->Sent(0x220, 0x20), 0);
}

TEST(SaaCanOperations, BadArgumentsAndOtherModelsAreRefused) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 90}");
  bus.Run(kSecond);
  const std::vector<std::pair<std::string, Arguments>> wrong = {
      {"set_period", {{"period_ms", "30"}}},     {"set_period", {}},
      {"set_direction", {{"direction", "cw"}}},  {"set_node_id", {{"node", "0"}}},
      {"set_node_id", {{"node", "0x21"}}},       {"set_bitrate", {{"bitrate", "125000"}}},
      {"read_position", {{"after", "nothing"}}}, {"save_parameters", {}}};
  for (const auto& [operation, arguments] : wrong) {
    EXPECT_EQ(bus.Do(operation, arguments).state, CommandState::kRejected) << operation;
  }
  EXPECT_EQ(bus.frames->sent().size(), 1U) << "the start";
}

TEST(SaaCanOperations, WhatChangesSomethingIsAskedForFirst) {
  for (const OperationSpec& operation : Operations()) {
    EXPECT_FALSE(operation.verification.empty()) << operation.name;
    if (FindOperation(SaaOperations(), operation.name) == nullptr) continue;  // of model cia406
    const bool datum = operation.name == "zero" || operation.name == "set_direction";
    const bool reads = operation.name == "read_position";
    EXPECT_EQ(operation.needs_standstill, datum) << operation.name;
    EXPECT_EQ(operation.destructive, !reads) << operation.name;
    EXPECT_EQ(operation.verified_by_operation.empty(), reads || operation.name == "stop_cyclic") << operation.name;
  }
}

}  // namespace
}  // namespace axlecast::saa_can
