// No operation claims an effect that its read-back would have shown without it (docs/commands.md).
#include <gtest/gtest.h>

#include "drivers/saa_serial/simulated_line_test_support.h"

namespace axlecast::saa_serial {
namespace {

const std::string kBus = "link: {port: /dev/ttyX, baud: 115200}, poll_hz: 100, mode: bus";

// Nothing answers a zero (5.1.6 (1)): only a shaft that was elsewhere shows its effect.
TEST(VerifiedOutcome, AZeroIsVerifiedOnlyWhereItsEffectCanBeSeen) {
  struct Case {
    const char* start_deg;
    const char* clears;
    CommandState state;
    bool verified;
  };
  for (const Case& c : {Case{"90", "true", CommandState::kSucceeded, true},
                        {"90", "false", CommandState::kFailed, false},
                        {"0", "true", CommandState::kIndeterminate, false},
                        {"0", "false", CommandState::kIndeterminate, false},
                        {"0.1", "true", CommandState::kIndeterminate, false},
                        {"359.7", "true", CommandState::kIndeterminate, false},
                        {"1", "true", CommandState::kSucceeded, true}}) {
    SimulatedBus bus(kBus + ", zero_clearing: true", "a: {bits: 14, address: 1}",
                     std::string("a: {start_deg: ") + c.start_deg + ", zero_clearing: " + c.clears + "}");
    bus.Run(100 * kMillisecond);
    bus.Begin(0, "zero");
    bus.Run(2 * kSecond);
    const Outcome& outcome = bus.output().outcomes.back().second;
    EXPECT_EQ(outcome.state, c.state) << c.start_deg << ": " << outcome.text;
    EXPECT_EQ(outcome.verified, c.verified) << c.start_deg << ": " << outcome.text;
    EXPECT_LE(outcome.text.size(), 200u);
  }
}

// When the request is sent, the bridge receives what a look would have found before.
TEST(VerifiedOutcome, ProgressTellsWhetherAnEffectCouldBeSeen) {
  for (const auto& [start, word] : {std::pair{"90", "no_effect_seen"}, {"0.1", "reads_as_after"}}) {
    SimulatedBus bus(kBus + ", zero_clearing: true", "a: {bits: 14, address: 1}",
                     std::string("a: {start_deg: ") + start + "}");
    bus.Run(100 * kMillisecond);
    bus.Begin(0, "zero");
    bus.Run(2 * kSecond);
    const Outcome& running = bus.output().outcomes.front().second;
    ASSERT_EQ(running.changes.size(), 2u);
    EXPECT_EQ(running.changes[1].key, "finding");
    EXPECT_EQ(running.changes[1].before, word) << start;
  }
}

}  // namespace
}  // namespace axlecast::saa_serial
