// No operation claims an effect that its read-back would have shown without it (docs/commands.md).
#include <gtest/gtest.h>

#include "drivers/saa_can/bus_test_support.h"

namespace axlecast::saa_can {
namespace {

// The reply `20 00` has the bytes of the position 32 (0.7 degrees at 14 bits): near this position, the two cannot be distinguished.
TEST(VerifiedOutcome, AZeroIsVerifiedOnlyWhereItsEffectCanBeSeen) {
  struct Case {
    const char* simulated;
    CommandState state;
    bool verified;
  };
  for (const Case& c : {Case{"start_deg: 123", CommandState::kSucceeded, true},
                        {"start_deg: 0.7", CommandState::kSucceeded, true},
                        {"start_deg: 0", CommandState::kSucceeded, false},
                        {"start_deg: 0.1", CommandState::kSucceeded, false},
                        {"start_deg: 359.7", CommandState::kSucceeded, false}}) {
    SimulatedBus bus("a: {bits: 14}", std::string("a: {") + c.simulated + "}");
    bus.Run(kSecond);
    const Outcome outcome = bus.Do("zero");
    EXPECT_EQ(outcome.state, c.state) << c.simulated << ": " << outcome.text;
    EXPECT_EQ(outcome.verified, c.verified) << c.simulated << ": " << outcome.text;
    EXPECT_LE(outcome.text.size(), 200U);
    EXPECT_EQ(bus.State("a", "zeroings"), "1");
  }
}

// It read 0 before, and was silent after it had confirmed the zero: it may have stored nothing.
TEST(VerifiedOutcome, AnEncoderThatWasSilentAfterItsReplyMayHaveStoredNothing) {
  SimulatedBus bus("a: {bits: 14}", "a: {start_deg: 0}");
  bus.Run(kSecond);
  bus.Begin("zero");
  while (bus.State("a", "zeroings") == "0") bus.Run(kMillisecond);
  bus.Run(2 * kMillisecond);
  bus.Set("a", "power", "off");
  bus.Run(kSecond);
  bus.Set("a", "power", "on");
  const Outcome outcome = bus.Finish();
  EXPECT_EQ(outcome.state, CommandState::kIndeterminate) << outcome.text;
  EXPECT_LE(outcome.text.size(), 200U);
}

}  // namespace
}  // namespace axlecast::saa_can
