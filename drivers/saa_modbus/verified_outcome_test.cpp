// No operation claims an effect that its read-back would have shown without it (docs/commands.md).
#include <gtest/gtest.h>

#include "drivers/saa_modbus/bus_test_support.h"

namespace axlecast::saa_modbus {
namespace {

TEST(VerifiedOutcome, AZeroIsVerifiedOnlyWhereItsEffectCanBeSeen) {
  struct Case {
    const char* start_deg;
    bool echo;
    CommandState state;
    bool verified;
  };
  for (const Case& c : {Case{"90", true, CommandState::kSucceeded, true},
                        {"90", false, CommandState::kSucceeded, true},
                        {"0", true, CommandState::kSucceeded, false},
                        {"0.1", true, CommandState::kSucceeded, false},
                        {"359.8", true, CommandState::kSucceeded, false},
                        {"0.1", false, CommandState::kIndeterminate, false}}) {
    Machine machine("axis1: {bits: 16}", std::string("axis1: {start_deg: ") + c.start_deg + "}");
    machine.Run(300 * kMillisecond);
    machine.Begin("zero");
    machine.RunToTheChange();
    EXPECT_EQ(ChangeOf(machine.output().outcomes.back().second, "finding").before,
              std::string(c.start_deg) == "90" ? "no_effect_seen" : "reads_as_after");
    if (!c.echo) machine.Set("axis1", "fault", "intermittent:1");
    machine.RunThroughTheChange();
    machine.Set("axis1", "fault", "none");
    const Outcome outcome = machine.Finish();
    EXPECT_EQ(outcome.state, c.state) << c.start_deg << ": " << outcome.text;
    EXPECT_EQ(outcome.verified, c.verified) << c.start_deg << ": " << outcome.text;
    EXPECT_LE(outcome.text.size(), 200U);
  }
}

// A setting is a state that is read back: if it is set already, the outcome states that, and nothing is written.
TEST(VerifiedOutcome, ASettingThatHeldAlreadyIsNotWrittenAndNamedSo) {
  Machine machine("axis1: {bits: 16}", "axis1: {start_deg: 90}");
  machine.Run(300 * kMillisecond);
  for (const auto& [operation, arguments] :
       {std::pair<std::string, Arguments>{"set_address", {{"address", "1"}}}, {"set_baud", {{"baud", "19200"}}}}) {
    const Outcome outcome = machine.Do(operation, arguments);
    EXPECT_EQ(outcome.state, CommandState::kSucceeded);
    EXPECT_NE(outcome.text.find("already: nothing was written"), std::string::npos) << outcome.text;
  }
  EXPECT_EQ(machine.State("writes"), "0");
}

}  // namespace
}  // namespace axlecast::saa_modbus
