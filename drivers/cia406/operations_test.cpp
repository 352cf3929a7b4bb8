#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>

#include "drivers/cia406/bench_test_support.h"

namespace axlecast::cia406 {
namespace {

using ::testing::HasSubstr;
using Reason = command_status_t;

constexpr const char* kCyclic = "node: 5, bits: 13, turn_bits: 12, period_ms: 10";

class Cia406OperationsTest : public BenchTest {};

TEST_F(Cia406OperationsTest, ZeroIsAPresetVerifiedByReading) {
  Build({kCyclic}, 0, "start_deg: 90");
  RunFor(kSecond);
  const Outcome& outcome = Do("zero");
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_TRUE(outcome.verified);
  ASSERT_EQ(outcome.changes.size(), 1U);
  EXPECT_EQ(outcome.changes[0].before, "33552384") << "the last turn at 270 degrees, clockwise";
  EXPECT_EQ(outcome.changes[0].after, "0");
  EXPECT_EQ(node().counters().presets, 1);
  RunFor(kSecond);
  EXPECT_EQ(output().jumps, 1);
  EXPECT_FALSE(output().datum_changing);
  EXPECT_EQ(output().nv_writes, 1);
  EXPECT_EQ(LastPosition(), 0);
}

TEST_F(Cia406OperationsTest, SetPositionInEveryMode) {
  for (const char* keys : {kCyclic, "node: 5, bits: 13, turn_bits: 12, mode: sdo",
                           "node: 5, bits: 13, turn_bits: 12, transmission: sync"}) {
    devices_.clear();
    Build({keys}, 100);
    RunFor(kSecond);
    const Outcome& outcome = Do("set_position counts=1234567");
    EXPECT_EQ(outcome.state, CommandState::kSucceeded) << keys << ": " << outcome.text;
    RunFor(kSecond);
    EXPECT_EQ(LastPosition(), 1234567) << keys;
    EXPECT_EQ(output().jumps, 1) << keys;
    EXPECT_FALSE(output().datum_changing) << keys;
  }
}

TEST_F(Cia406OperationsTest, APresetNeedsStandstillWhenItGoesOut) {
  Build({kCyclic});
  RunFor(kSecond);
  output().motion = {.known = true, .standstill = false, .speed_rpm = 3};
  EXPECT_EQ(Do("zero").reason, Reason::REASON_NOT_STANDING_STILL);
  output().motion = {};
  EXPECT_EQ(Do("zero").reason, Reason::REASON_NOT_STANDING_STILL);
  // It begins to turn after the command has begun.
  output().motion = {.known = true, .standstill = true};
  Set("answer_us", "50000");
  devices_[0]->Begin({.id = {}, .operation = "zero", .arguments = {}}, clock_.Now());
  RunFor(20 * kMillisecond);
  output().motion.standstill = false;
  RunFor(kSecond);
  EXPECT_EQ(output().outcomes.back().second.reason, Reason::REASON_NOT_STANDING_STILL);
  EXPECT_EQ(node().counters().presets, 0);
}

TEST_F(Cia406OperationsTest, ARefusedPresetChangesNothing) {
  Build({kCyclic});
  RunFor(kSecond);
  Set("object", "6003:00=none");
  const Outcome& outcome = Do("zero");
  EXPECT_EQ(outcome.state, CommandState::kFailed);
  EXPECT_EQ(outcome.reason, Reason::REASON_DEVICE_REFUSED);
  EXPECT_THAT(outcome.text, HasSubstr("object does not exist (0x06020000)"));
  RunFor(kSecond);
  EXPECT_EQ(output().jumps, 0);
  EXPECT_FALSE(output().datum_changing);
}

TEST_F(Cia406OperationsTest, APresetThatIsNotReadBackFails) {
  Build({kCyclic}, 0, "start_deg: 90, noise_counts: 1000, seed: 2");
  RunFor(kSecond);
  const Outcome& outcome = Do("zero");
  EXPECT_EQ(outcome.state, CommandState::kFailed) << outcome.text;
  EXPECT_EQ(outcome.reason, Reason::REASON_READ_BACK_DIFFERS);
  EXPECT_EQ(node().counters().presets, 1) << "never repeated";
}

// The write went out, its answer and all that follows are lost.
TEST_F(Cia406OperationsTest, ASilenceAfterThePresetIsIndeterminate) {
  Build({kCyclic});
  RunFor(kSecond);
  Set("answer_us", "20000");
  devices_[0]->Begin({.id = {}, .operation = "zero", .arguments = {}}, clock_.Now());
  while (node().counters().presets == 0) RunFor(kMillisecond);
  Set("power", "off");
  RunFor(30 * kSecond);
  const Outcome& outcome = output().outcomes.back().second;
  EXPECT_EQ(outcome.state, CommandState::kIndeterminate) << outcome.text;
  EXPECT_EQ(node().counters().presets, 1) << "never repeated";
  Set("power", "on");
  RunFor(3 * kSecond);
  EXPECT_EQ(output().jumps, 1) << "in doubt it counts as moved";
  EXPECT_FALSE(output().datum_changing);
}

TEST_F(Cia406OperationsTest, WhenTheAnswerIsLostTheReadingDecides) {
  Build({std::string(kCyclic) + ", sdo_timeout_ms: 30"}, 0, "start_deg: 90");
  RunFor(kSecond);
  const Outcome& outcome = DoWithLostAnswer("set_position", {{"counts", "5000"}});
  EXPECT_TRUE(outcome.IsFinal());
  EXPECT_EQ(node().counters().presets, 1);
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
}

TEST_F(Cia406OperationsTest, ReadPositionLooksWhetherAPresetTookEffect) {
  Build({kCyclic}, 0, "start_deg: 180");
  RunFor(kSecond);
  EXPECT_EQ(Do("read_position").text, "turns 4095, single-turn 4096 (180.0000 deg)");
  DriverCommand look{.id = {}, .operation = "read_position", .arguments = {{"after", "zero"}}};
  const auto finding = [&] {
    output().outcomes.clear();
    devices_[0]->Begin(look, clock_.Now());
    RunFor(100 * kMillisecond);
    return output().outcomes.back().second.changes.back().after;
  };
  EXPECT_EQ(finding(), "no_effect_seen");
  output().motion.standstill = false;
  EXPECT_EQ(finding(), "cannot_tell");
  output().motion.standstill = true;
  EXPECT_EQ(Do("zero").state, CommandState::kSucceeded);
  EXPECT_EQ(finding(), "reads_as_after");
  look.arguments = {{"after", "set_position counts=0"}};
  EXPECT_EQ(finding(), "reads_as_after");
}

TEST_F(Cia406OperationsTest, BadArgumentsAreNamed) {
  Build({kCyclic});
  RunFor(kSecond);
  EXPECT_EQ(Do("set_position").reason, Reason::REASON_BAD_ARGUMENT);
  EXPECT_THAT(Do("set_position counts=33554432").text, HasSubstr("0 to 2^25 - 1"));
  EXPECT_EQ(Do("set_position counts=33554431").state, CommandState::kSucceeded);
  EXPECT_EQ(Do("read_position after=save_parameters").reason, Reason::REASON_BAD_ARGUMENT);
  EXPECT_EQ(Do("set_baud").reason, Reason::REASON_UNKNOWN_OPERATION);
}

TEST_F(Cia406OperationsTest, ReadIdentity) {
  Build({kCyclic}, 0, "vendor: 0x2dc, product: 0x58, revision: 0x00010002, serial: 4711");
  RunFor(kSecond);
  const Outcome& outcome = Do("read_identity");
  EXPECT_EQ(outcome.text, "device type 0x00020196: profile 406");
  ASSERT_EQ(outcome.changes.size(), 4U);
  EXPECT_EQ(outcome.changes[0].after, "0x000002DC");
  EXPECT_EQ(outcome.changes[3].key, "serial");
  EXPECT_EQ(outcome.changes[3].after, "0x00001267");
}

TEST_F(Cia406OperationsTest, ReadState) {
  Build({kCyclic});
  RunFor(kSecond);
  Set("object", "6505:00=none");
  Set("alarms", "1");
  const Outcome& outcome = Do("read_state");
  EXPECT_EQ(outcome.text, "NMT state operational (not from a heartbeat); errors: none");
  EXPECT_EQ(outcome.changes[1].after, "0x0004");
  EXPECT_EQ(outcome.changes[2].after, "0x0001");
  EXPECT_EQ(outcome.changes[3].after, "not offered");
}

TEST_F(Cia406OperationsTest, SaveIsConfirmedByTheEncoder) {
  Build({kCyclic}, 0, "start_deg: 90, save_ms: 600");
  RunFor(kSecond);
  EXPECT_EQ(Do("zero").state, CommandState::kSucceeded);
  const Outcome& outcome = Do("save_parameters");
  EXPECT_EQ(outcome.state, CommandState::kSucceeded) << outcome.text;
  EXPECT_FALSE(outcome.verified);
  EXPECT_EQ(node().counters().saves, 1);
  Set("power", "cycle");
  RunFor(2 * kSecond);
  EXPECT_EQ(LastPosition(), 0) << "the preset was stored";
}

TEST_F(Cia406OperationsTest, WithoutASaveAPresetIsLostAndItsLossIsAJump) {
  Build({kCyclic}, 0, "start_deg: 90");
  RunFor(kSecond);
  EXPECT_EQ(Do("zero").state, CommandState::kSucceeded);
  RunFor(kSecond);
  EXPECT_EQ(output().jumps, 1);
  Set("power", "cycle");
  RunFor(kSecond);
  EXPECT_EQ(LastPosition() & 0x1FFF, 6144);
  EXPECT_EQ(output().jumps, 2) << "6509h is another than before";
}

TEST_F(Cia406OperationsTest, AnEncoderThatDoesNotSaveOnCommandIsNotTold) {
  Build({kCyclic});
  RunFor(kSecond);
  Set("object", "1010:01=2");
  EXPECT_EQ(Do("save_parameters").state, CommandState::kRejected);
  EXPECT_EQ(node().counters().saves, 0);
  Set("object", "1010:01=none");
  EXPECT_EQ(Do("save_parameters").state, CommandState::kRejected);
}

TEST_F(Cia406OperationsTest, ASaveThatIsNotConfirmedIsIndeterminate) {
  Build({kCyclic}, 0, "save_ms: 30000");
  RunFor(kSecond);
  EXPECT_EQ(Do("save_parameters").state, CommandState::kIndeterminate);
}

TEST_F(Cia406OperationsTest, ALostLinkEndsEveryOrder) {
  for (const char* command :
       {"zero", "set_position counts=5", "read_position", "read_identity", "read_state", "save_parameters"}) {
    devices_.clear();
    Build({kCyclic}, 0, "answer_us: 20000");
    RunFor(3 * kSecond);
    const CommandLine line = ParseCommandLine(command);
    devices_[0]->Begin({.id = {}, .operation = line.operation, .arguments = line.arguments}, clock_.Now());
    RunFor(50 * kMillisecond);
    link_->Unplug();
    RunFor(kSecond);
    ASSERT_FALSE(output().outcomes.empty()) << command;
    EXPECT_TRUE(output().outcomes.back().second.IsFinal()) << command;
    link_->Plug();
  }
}

TEST_F(Cia406OperationsTest, AnOrderThatHasNotTouchedAnythingCanBeCancelledOrExpires) {
  Build({kCyclic}, 0, "answer_us: 20000");
  RunFor(3 * kSecond);
  devices_[0]->Begin({.id = {9}, .operation = "zero", .arguments = {}}, clock_.Now());
  EXPECT_FALSE(devices_[0]->Cancel({8}, clock_.Now()));
  EXPECT_TRUE(devices_[0]->Cancel({9}, clock_.Now()));
  devices_[0]->Begin(
      {.id = {10}, .operation = "zero", .arguments = {}, .begin_by = clock_.Now() + 10 * kMillisecond},
      clock_.Now());
  RunFor(kSecond);
  EXPECT_EQ(output().outcomes.back().second.state, CommandState::kExpired);
  EXPECT_EQ(node().counters().presets, 0);
}

// Once a read-only command has sent its request, the time to begin does not matter any more.
TEST_F(Cia406OperationsTest, AReadThatHasBegunDoesNotExpire) {
  Build({kCyclic}, 0, "answer_us: 50000");
  RunFor(3 * kSecond);
  devices_[0]->Begin(
      {.id = {11}, .operation = "read_identity", .arguments = {}, .begin_by = clock_.Now() + 10 * kMillisecond},
      clock_.Now());
  RunFor(kSecond);
  EXPECT_EQ(output().outcomes.back().second.state, CommandState::kSucceeded);
}

}  // namespace
}  // namespace axlecast::cia406
