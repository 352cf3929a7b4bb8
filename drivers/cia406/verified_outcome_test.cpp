// No operation claims an effect that its read-back would have shown without it (docs/commands.md).
#include <gtest/gtest.h>

#include "drivers/cia406/bench_test_support.h"

namespace axlecast::cia406 {
namespace {

class VerifiedOutcomeTest : public BenchTest {};

TEST_F(VerifiedOutcomeTest, APresetIsVerifiedOnlyWhereItsEffectCanBeSeen) {
  struct Case {
    const char* operation;
    const char* start_deg;
    bool verified;
  };
  for (const Case& c : {Case{"zero", "90", true},
                        {"zero", "0", false},
                        {"zero", "0.1", false},
                        {"set_position counts=2048", "0", true},
                        {"set_position counts=8", "0", false}}) {
    devices_.clear();
    Build({"node: 5, bits: 13, turn_bits: 12, period_ms: 10"}, 0, std::string("start_deg: ") + c.start_deg);
    RunFor(kSecond);
    const Outcome& outcome = Do(c.operation);
    EXPECT_EQ(outcome.state, CommandState::kSucceeded) << c.operation << ": " << outcome.text;
    EXPECT_EQ(outcome.verified, c.verified) << c.operation << " at " << c.start_deg << ": " << outcome.text;
    EXPECT_EQ(node().counters().presets, 1);
  }
}

// The write went out, its answer is lost, and the position reads as before: nothing shows whether it was taken.
TEST_F(VerifiedOutcomeTest, WithoutAnswerAndWithoutAVisibleEffectItIsIndeterminate) {
  Build({"node: 5, bits: 13, turn_bits: 12, period_ms: 10, sdo_timeout_ms: 30"});
  RunFor(kSecond);
  const Outcome& outcome = DoWithLostAnswer("zero", {});
  EXPECT_EQ(node().counters().presets, 1);
  EXPECT_EQ(outcome.state, CommandState::kIndeterminate) << outcome.text;
}

// It read the same before, and was silent or restarted after it had confirmed the write: it may have stored nothing.
TEST_F(VerifiedOutcomeTest, ANodeThatWasSilentAfterItsConfirmationMayHaveStoredNothing) {
  for (const bool restarts : {false, true}) {
    devices_.clear();
    Build({"node: 5, bits: 13, turn_bits: 12, period_ms: 10, sdo_timeout_ms: 30, preset_settle_ms: 100"}, 0,
          "boot_ms: 5");
    RunFor(kSecond);
    devices_[0]->Begin({.id = {}, .operation = "zero", .arguments = {}}, clock_.Now());
    while (node().counters().presets == 0) RunFor(100 * kMicrosecond);
    RunFor(20 * kMillisecond);
    ASSERT_EQ(output().outcomes.back().second.state, CommandState::kRunning) << "the write is confirmed";
    Set("power", "off");
    RunFor(restarts ? 5 * kMillisecond : 200 * kMillisecond);
    Set("power", "on");
    RunFor(5 * kSecond);
    const Outcome& outcome = output().outcomes.back().second;
    EXPECT_EQ(outcome.state, CommandState::kIndeterminate) << outcome.text;
    EXPECT_LE(outcome.text.size(), 200U);
  }
}

}  // namespace
}  // namespace axlecast::cia406
