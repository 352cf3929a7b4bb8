#include "drivers/kit/command_runner.h"

#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>
#include <vector>

#include "tests/support/recording_output.h"

namespace axlecast {
namespace {

using S = command_status_t;
using ::testing::HasSubstr;

const std::vector<OperationSpec> kOperations = {{.name = "read", .help = "", .reads_only = true},
                                                {.name = "zero", .help = "", .needs_standstill = true}};

struct FakeProcedure final : CommandProcedure {
  explicit FakeProcedure(const bool& is_touched) : touches(is_touched) {}
  [[nodiscard]] Outcome OnLinkLost() const override {
    return Final(CommandState::kFailed, S::REASON_NO_REPLY, "the link was lost");
  }
  [[nodiscard]] bool touched() const override { return touches; }
  const bool& touches;
};

class CommandRunnerTest : public ::testing::Test, protected CommandRunner<FakeProcedure>::Policy {
 protected:
  CommandRunnerTest() { output_.motion = {.known = true, .standstill = true, .counts = 7}; }

  Result<std::unique_ptr<FakeProcedure>> MakeProcedure(const DriverCommand& command, MonoNs) const override {
    if (!command.arguments.empty()) return BadArgument("count must be 1 to 9");
    return std::make_unique<FakeProcedure>(touched_);
  }
  Result<> CheckState(const DriverCommand&, MonoNs) const override {
    return online_ ? Result<>() : DeviceOffline("the encoder does not answer");
  }
  Result<> CheckPosition(const DriverCommand&, const Motion& motion) const override {
    return motion.counts < 10 ? Result<>() : NotPermitted("only below 10 counts");
  }

  static DriverCommand Command(std::string operation = "read", MonoNs begin_by = kNever) {
    return {.id = {1}, .operation = std::move(operation), .arguments = {}, .begin_by = begin_by};
  }
  [[nodiscard]] std::int32_t ReasonOf(const DriverCommand& command, bool link_up = true, MonoNs now = 0) const {
    const Result<> valid = runner_.Validate(command, link_up, now);
    return valid ? S::REASON_NONE : valid.error().reason;
  }
  // The last outcome that was reported.
  [[nodiscard]] const Outcome& Last() const { return output_.outcomes.back().second; }

  bool touched_ = false;
  bool online_ = true;
  RecordingOutput output_;
  CommandRunner<FakeProcedure> runner_{kOperations, *this, output_};
};

TEST_F(CommandRunnerTest, ValidateNamesTheFirstReasonAndChangesNothing) {
  EXPECT_EQ(ReasonOf(Command()), S::REASON_NONE);
  DriverCommand wrong = Command("zero", 5);
  wrong.arguments = {{"count", "0"}};
  EXPECT_EQ(ReasonOf(wrong, false, 9), S::REASON_BAD_ARGUMENT);
  EXPECT_EQ(ReasonOf(Command("read", 5), false, 6), S::REASON_DEADLINE);
  EXPECT_EQ(ReasonOf(Command("read", 5), true, 5), S::REASON_NONE);
  EXPECT_EQ(ReasonOf(Command(), false), S::REASON_DEVICE_OFFLINE);
  online_ = false;
  EXPECT_EQ(ReasonOf(Command()), S::REASON_DEVICE_OFFLINE);
  EXPECT_FALSE(runner_.busy());
  EXPECT_TRUE(output_.outcomes.empty());
}

TEST_F(CommandRunnerTest, OnlyAnOperationThatNeedsAStandstillIsRefusedInMotion) {
  output_.motion.standstill = false;
  output_.motion.speed_rpm = 12;
  EXPECT_EQ(ReasonOf(Command("read")), S::REASON_NONE);
  EXPECT_EQ(ReasonOf(Command("zero")), S::REASON_NOT_STANDING_STILL);
  EXPECT_THAT(runner_.Validate(Command("zero"), true, 0).error().text, HasSubstr("12 rpm"));
  output_.motion = {.known = true, .standstill = true, .counts = 10};
  EXPECT_EQ(ReasonOf(Command("zero")), S::REASON_NOT_PERMITTED);
  EXPECT_EQ(ReasonOf(Command("read")), S::REASON_NONE);
}

// A shaft of which too little is known may turn.
TEST_F(CommandRunnerTest, AShaftIsAtRestOnlyIfTheReadingsProveIt) {
  for (const bool known : {false, true}) {
    for (const bool standstill : {false, true}) {
      output_.motion = {.known = known, .standstill = standstill};
      EXPECT_EQ(AtRest(output_, 0), known && standstill) << known << standstill;
      EXPECT_EQ(ReasonOf(Command("zero")) == S::REASON_NOT_STANDING_STILL, !(known && standstill));
    }
  }
}

TEST(Standstill, TheRefusalStatesWhatTheReadingsShowAndWhatToDo) {
  EXPECT_THAT(MotionText({.known = false}), HasSubstr("poll faster, or set limits"));
  EXPECT_THAT(MotionText({.known = true, .speed_rpm = 12}), HasSubstr("turns at 12 rpm; stop the axis"));
  const Outcome outcome = NotAtRest({.known = false});
  EXPECT_EQ(outcome.state, CommandState::kRejected);
  EXPECT_EQ(outcome.reason, S::REASON_NOT_STANDING_STILL);
  EXPECT_THAT(outcome.text, HasSubstr("poll faster"));
}

TEST_F(CommandRunnerTest, ARefusedCommandHasItsOutcomeAtOnce) {
  EXPECT_FALSE(runner_.Begin(Command("read", 5), true, 6));
  EXPECT_EQ(Last().state, CommandState::kExpired);
  EXPECT_EQ(Last().text, "nothing was done: its time to begin was over");
  online_ = false;
  EXPECT_FALSE(runner_.Begin(Command(), true, 0));
  EXPECT_EQ(Last().state, CommandState::kRejected);
  EXPECT_FALSE(runner_.busy());
}

TEST_F(CommandRunnerTest, OneCommandAtATimeUntilItsFinalOutcome) {
  ASSERT_TRUE(runner_.Begin(Command(), true, 0));
  EXPECT_EQ(ReasonOf(Command()), S::REASON_BUSY);
  EXPECT_FALSE(runner_.Report(std::nullopt));
  Outcome running;
  running.progress = 0.5F;
  EXPECT_FALSE(runner_.Report(running));
  EXPECT_TRUE(runner_.busy());
  EXPECT_TRUE(runner_.Report(Verified("done")));
  EXPECT_FALSE(runner_.busy());
  EXPECT_EQ(output_.outcomes.size(), 2U);
  EXPECT_EQ(output_.outcomes.back().first, (CommandId{1}));
  EXPECT_EQ(ReasonOf(Command()), S::REASON_NONE);
}

TEST_F(CommandRunnerTest, ACommandExpiresAfterItsTimeToBeginAndNotWithIt) {
  ASSERT_TRUE(runner_.Begin(Command("read", 5), true, 0));
  EXPECT_EQ(runner_.ExpiresAt(), 6);
  EXPECT_NE(runner_.Runnable(5), nullptr);
  EXPECT_FALSE(runner_.ExpireIfLate(5));
  EXPECT_EQ(runner_.Runnable(6), nullptr);
  EXPECT_TRUE(runner_.ExpireIfLate(6));
  EXPECT_EQ(Last().state, CommandState::kExpired);
  EXPECT_EQ(Last().reason, S::REASON_DEADLINE);
  EXPECT_FALSE(runner_.busy());
  EXPECT_EQ(runner_.ExpiresAt(), kNever);
}

TEST_F(CommandRunnerTest, ACommandDoesNotExpireOnceItsRequestWasSentOrItTouchedTheDevice) {
  ASSERT_TRUE(runner_.Begin(Command("read", 5), true, 0));
  runner_.OnStarted(false);
  EXPECT_EQ(runner_.Runnable(6), nullptr);
  runner_.OnStarted(true);
  EXPECT_NE(runner_.Runnable(6), nullptr);
  EXPECT_EQ(runner_.ExpiresAt(), kNever);
  EXPECT_TRUE(runner_.Report(Verified("done")));

  ASSERT_TRUE(runner_.Begin(Command("read", 5), true, 0));
  EXPECT_TRUE(!runner_.Runnable(6));
  touched_ = true;
  EXPECT_FALSE(runner_.ExpireIfLate(6));
  EXPECT_TRUE(runner_.busy());
}

TEST_F(CommandRunnerTest, ACommandWithoutDeadlineNeverExpires) {
  ASSERT_TRUE(runner_.Begin(Command(), true, 0));
  EXPECT_EQ(runner_.ExpiresAt(), kNever);
  EXPECT_FALSE(runner_.ExpireIfLate(kNever));
}

TEST_F(CommandRunnerTest, CancelsItsOwnCommandUntilTheDeviceWasTouched) {
  ASSERT_TRUE(runner_.Begin(Command(), true, 0));
  EXPECT_FALSE(runner_.Cancel({2}));
  touched_ = true;
  EXPECT_FALSE(runner_.Cancel({1}));
  touched_ = false;
  EXPECT_TRUE(runner_.Cancel({1}));
  EXPECT_FALSE(runner_.busy());
  EXPECT_FALSE(runner_.Cancel({1}));
  EXPECT_TRUE(output_.outcomes.empty());
}

// The reply comes after its command was cancelled, and another one has begun.
TEST_F(CommandRunnerTest, AReplyBelongsToTheProcedureThatAskedForIt) {
  ASSERT_TRUE(runner_.Begin(Command(), true, 0));
  runner_.OnStarted(true);
  EXPECT_TRUE(runner_.TakeInFlight());
  EXPECT_FALSE(runner_.TakeInFlight());
  runner_.OnStarted(true);
  ASSERT_TRUE(runner_.Cancel({1}));
  ASSERT_TRUE(runner_.Begin(Command(), true, 0));
  EXPECT_FALSE(runner_.TakeInFlight());
}

TEST_F(CommandRunnerTest, ALostLinkEndsTheCommandWithTheProceduresOutcome) {
  runner_.OnLinkLost();
  EXPECT_TRUE(output_.outcomes.empty());
  ASSERT_TRUE(runner_.Begin(Command(), true, 0));
  runner_.OnStarted(true);
  runner_.OnLinkLost();
  EXPECT_EQ(Last().text, "the link was lost");
  EXPECT_FALSE(runner_.busy());
  EXPECT_FALSE(runner_.TakeInFlight());
}

// ---- what reading back proves ----

TEST(ReadBack, AnEffectIsClaimedOnlyWhereTheDeviceReadDifferentlyBefore) {
  const Outcome seen = ReadBackOutcome({.same_before = false, .confirmed = false}, "reads 0");
  EXPECT_EQ(seen.state, CommandState::kSucceeded);
  EXPECT_TRUE(seen.verified);
  EXPECT_EQ(seen.text, "reads 0");

  const Outcome confirmed = ReadBackOutcome({.same_before = true, .confirmed = true}, "reads 0");
  EXPECT_EQ(confirmed.state, CommandState::kSucceeded);
  EXPECT_FALSE(confirmed.verified);
  EXPECT_NE(confirmed.text.find("no effect can be seen"), std::string::npos);

  const Outcome neither = ReadBackOutcome({.same_before = true, .confirmed = false}, "reads 0");
  EXPECT_EQ(neither.state, CommandState::kIndeterminate);
  EXPECT_FALSE(neither.verified);
}

// A shaft that flickers from 11 to 10 counts was not zeroed by that, where 10 counts pass for 0.
TEST(ReadBack, AValueBesideTheToleranceCannotBeToldApart) {
  EXPECT_TRUE(CannotBeToldApart(0, 0, 10, 1024));
  EXPECT_TRUE(CannotBeToldApart(11, 0, 10, 1024));
  EXPECT_TRUE(CannotBeToldApart(1004, 0, 10, 1024));
  EXPECT_FALSE(CannotBeToldApart(21, 0, 10, 1024));
  EXPECT_FALSE(CannotBeToldApart(1003, 0, 10, 1024));
}

TEST(ReadBack, ADeviceAloneFindsThatItReadsAsAfterTheOperationNoMore) {
  EXPECT_EQ(FindingChange(FindingWord(true)).after, "reads_as_after");
  EXPECT_EQ(FindingChange(FindingWord(false)).after, "no_effect_seen");
}

TEST(ReadBack, WhatALookWouldHaveFoundBeforeIsToldWhileTheEffectIsOpen) {
  for (const auto& [state, told] : {std::pair{CommandState::kRunning, true},
                                    {CommandState::kIndeterminate, true},
                                    {CommandState::kSucceeded, false},
                                    {CommandState::kFailed, false}}) {
    const Outcome outcome = WithFindingBefore({.state = state}, true);
    ASSERT_EQ(outcome.changes.size(), told ? 1U : 0U);
    EXPECT_EQ(told ? outcome.changes[0].before : "reads_as_after", "reads_as_after");
  }
}

// 40" either way are 80" between two readings: 4.05 counts of 19.8" at 16 bits.
TEST(Accuracy, IsTwiceAsMuchBetweenTwoReadings) {
  EXPECT_EQ(NoiseOfAccuracy(40, 16), 5);
  EXPECT_EQ(NoiseOfAccuracy(20, 17), 5);
  EXPECT_EQ(NoiseOfAccuracy(15, 20), 25);
  EXPECT_EQ(NoiseOfAccuracy(5, 26), 518);
  EXPECT_EQ(NoiseOfAccuracy(5, 32), 33'141);
  EXPECT_EQ(NoiseOfAccuracy(40, 10), 1);
  EXPECT_EQ(NoiseOfAccuracy(0, 20), 1);
  EXPECT_EQ(NoiseOfAccuracy(10'125, 10), 16) << "a 64th of a turn is a whole number of counts";
}

}  // namespace
}  // namespace axlecast
