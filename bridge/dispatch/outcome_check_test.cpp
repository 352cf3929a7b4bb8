#include "bridge/dispatch/outcome_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "core/command/commands.h"
#include "tests/support/counting_family.h"

namespace axlecast {
namespace {

using S = command_status_t;
using Purpose = PendingCommand::Purpose;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

constexpr MonoNs kNow = 100 * kSecond;
constexpr MonoNs kGiveUp = 200 * kSecond;

PendingCommand Lost(const std::string& operation, std::int32_t reason) {
  PendingCommand command;
  command.id = NumberedId(1);
  command.device = "axis1";
  command.operation = FindOperation(CountingFamily(), operation);
  command.sent_epoch = 12;
  command.status.driver_boot_id = 7;
  command.status.reason_code = reason;
  return command;
}

// ---- which check ----

TEST(OutcomeCheck, OfASilentDriverItIsAboutItsOrderAndItsBoot) {
  const auto check = OutcomeCheckFor(Lost("bump", S::REASON_DRIVER_SILENT), CountingFamily(), kGiveUp);
  ASSERT_TRUE(check);
  EXPECT_EQ(check->purpose, Purpose::kOutcomeCheck);
  EXPECT_EQ(check->device, "axis1");
  EXPECT_EQ(check->about, NumberedId(1));
  EXPECT_EQ(check->about_boot_id, 7);
  EXPECT_EQ(check->about_epoch, 12);
  EXPECT_TRUE(check->about_silent);
  EXPECT_EQ(check->begin_by, kGiveUp);
  ASSERT_NE(check->operation, nullptr);
  EXPECT_EQ(check->operation->name, "look");
}

TEST(OutcomeCheck, WhatNothingVerifiesIsCheckedOnlyIfItsDriverMayStillReport) {
  const auto silent = OutcomeCheckFor(Lost("write", S::REASON_DRIVER_SILENT), CountingFamily(), kGiveUp);
  ASSERT_TRUE(silent);
  EXPECT_EQ(silent->operation, nullptr);
  EXPECT_FALSE(OutcomeCheckFor(Lost("write", S::REASON_DRIVER_RESTARTED), CountingFamily(), kGiveUp));
  const auto restarted = OutcomeCheckFor(Lost("bump", S::REASON_DRIVER_RESTARTED), CountingFamily(), kGiveUp);
  ASSERT_TRUE(restarted);
  EXPECT_FALSE(restarted->about_silent);
}

TEST(OutcomeCheck, TheReadIsToldWhatItFollowsUpToTheLengthOfAnArgument) {
  for (const bool fits : {true, false}) {
    PendingCommand mark = Lost("mark", S::REASON_DRIVER_RESTARTED);
    const std::size_t head = std::string("mark note=").size();
    mark.arguments = {{"note", std::string(kArgumentBytes - head + (fits ? 0 : 1), 'x')}};
    const auto check = OutcomeCheckFor(mark, CountingFamily(), kGiveUp);
    ASSERT_TRUE(check);
    EXPECT_THAT(check->arguments, SizeIs(fits ? 1 : 0));
  }
}

// ---- whether it is repeated ----

PendingCommand Looked(std::int8_t state, std::int32_t reason) {
  PendingCommand check = Lost("bump", S::REASON_NONE);
  check.purpose = Purpose::kOutcomeCheck;
  check.operation = FindOperation(CountingFamily(), "look");
  check.begin_by = kGiveUp;
  check.nv_writes = 3;
  check.status.state = state;
  check.status.reason_code = reason;
  check.status.text = "no reply";
  return check;
}

TEST(OutcomeCheck, ALookWithoutReplyIsRepeatedHalfASecondLater) {
  const auto again = NextOutcomeCheck(Looked(S::STATE_FAILED, S::REASON_NO_REPLY), kNow);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->not_before, kNow + kCheckAgain);
  EXPECT_EQ(again->about, Looked(S::STATE_FAILED, S::REASON_NO_REPLY).about);
  EXPECT_EQ(again->status.text, "");
  EXPECT_EQ(again->status.driver_boot_id, 0);
  EXPECT_EQ(again->nv_writes, 0);
}

TEST(OutcomeCheck, ALookThatIsRefusedForATimeIsRepeated) {
  EXPECT_TRUE(NextOutcomeCheck(Looked(S::STATE_REJECTED, S::REASON_BUSY), kNow));
  EXPECT_FALSE(NextOutcomeCheck(Looked(S::STATE_REJECTED, S::REASON_NOT_PERMITTED), kNow));
  EXPECT_FALSE(NextOutcomeCheck(Looked(S::STATE_FAILED, S::REASON_BUSY), kNow));
  EXPECT_FALSE(NextOutcomeCheck(Looked(S::STATE_REJECTED, S::REASON_NO_REPLY), kNow));
  EXPECT_FALSE(NextOutcomeCheck(Looked(S::STATE_SUCCEEDED, S::REASON_NONE), kNow));
}

TEST(OutcomeCheck, ALookIsNotRepeatedWhenItsTimeWouldBeOver) {
  const PendingCommand looked = Looked(S::STATE_FAILED, S::REASON_NO_REPLY);
  EXPECT_TRUE(NextOutcomeCheck(looked, kGiveUp - kCheckAgain - 1));
  EXPECT_FALSE(NextOutcomeCheck(looked, kGiveUp - kCheckAgain));
}

TEST(OutcomeCheck, AQuestionToTheDriverIsNotRepeatedAsALook) {
  PendingCommand asked = Looked(S::STATE_FAILED, S::REASON_NO_REPLY);
  asked.queries_driver = true;
  EXPECT_FALSE(NextOutcomeCheck(asked, kNow));
  PendingCommand nothing = Looked(S::STATE_FAILED, S::REASON_NO_REPLY);
  nothing.operation = nullptr;
  EXPECT_FALSE(NextOutcomeCheck(nothing, kNow));
}

// ---- what it adds ----

S Reported(std::int8_t state, std::int32_t reason, std::int8_t verified) {
  PendingCommand asked = Looked(state, reason);
  asked.queries_driver = true;
  asked.status.verified = verified;
  asked.status.changes = {{"count", "4", "5"}};
  S outcome{};
  outcome.text = "silent";
  AddCheckedOutcome(asked, outcome);
  return outcome;
}

TEST(OutcomeCheck, WhatASilentDriverReportsLateIsTheFinding) {
  const S done = Reported(S::STATE_SUCCEEDED, S::REASON_NONE, 1);
  EXPECT_EQ(done.finding, S::FINDING_EFFECT_SEEN);
  ASSERT_EQ(done.n_changes, 1);
  EXPECT_EQ(done.changes[0].after, "5");
  EXPECT_THAT(done.text, HasSubstr("silent; afterwards: effect_seen"));
  EXPECT_EQ(Reported(S::STATE_SUCCEEDED, S::REASON_NONE, 0).finding, S::FINDING_CANNOT_TELL);
  EXPECT_EQ(Reported(S::STATE_FAILED, S::REASON_NO_REPLY, 0).finding, S::FINDING_CANNOT_TELL);
  for (const std::int8_t state : {S::STATE_REJECTED, S::STATE_CANCELLED}) {
    EXPECT_EQ(Reported(state, S::REASON_DEADLINE, 0).finding, S::FINDING_NO_EFFECT_SEEN);
  }
  EXPECT_EQ(Reported(S::STATE_EXPIRED, S::REASON_DRIVER_SILENT, 0).finding, S::FINDING_NO_EFFECT_SEEN)
      << "the driver never received it";
  EXPECT_EQ(Reported(S::STATE_EXPIRED, S::REASON_DEADLINE, 0).finding, S::FINDING_CANNOT_TELL)
      << "the question expired, and not the command";
}

// `before`: as the lost driver had reported it; `after`: what the look has found.
std::int8_t Compared(std::vector<change_t> before, std::vector<change_t> after) {
  PendingCommand looked = Looked(S::STATE_SUCCEEDED, S::REASON_NONE);
  looked.status.driver_boot_id = 7;
  looked.status.changes = std::move(after);
  looked.status.changes.push_back({"finding", "", "reads_as_after"});
  S outcome{};
  outcome.changes = std::move(before);
  AddCheckedOutcome(looked, outcome);
  return outcome.finding;
}

TEST(OutcomeCheck, AnEffectIsSeenIfOneOfTheValuesDiffersFromBefore) {
  EXPECT_EQ(Compared({{"a", "1", ""}, {"b", "1", ""}}, {{"a", "", "1"}, {"b", "", "1"}}), S::FINDING_CANNOT_TELL);
  EXPECT_EQ(Compared({{"a", "1", ""}, {"b", "1", ""}}, {{"a", "", "1"}, {"b", "", "2"}}), S::FINDING_EFFECT_SEEN);
  EXPECT_EQ(Compared({{"a", "1", ""}, {"b", "1", ""}}, {{"a", "", "2"}, {"b", "", "1"}}), S::FINDING_EFFECT_SEEN);
}

TEST(OutcomeCheck, AValueWithoutOneBeforeIsNotCompared) {
  EXPECT_EQ(Compared({{"a", "", "2"}}, {{"a", "", "2"}}), S::FINDING_CANNOT_TELL);
  EXPECT_EQ(Compared({{"a", "", "2"}, {"b", "1", ""}}, {{"a", "", "3"}, {"b", "", "1"}}), S::FINDING_CANNOT_TELL);
  EXPECT_EQ(Compared({{"finding", "", "reads_as_after"}, {"b", "1", ""}}, {{"b", "", "2"}}), S::FINDING_EFFECT_SEEN)
      << "a judgement without a value before does not count";
}

TEST(OutcomeCheck, AReadThatTakesNoArgumentIsGivenNone) {
  static const std::vector<OperationSpec> kOperations = {
      {.name = "set", .help = "", .destructive = true, .verified_by_operation = "get"},
      {.name = "get", .help = "", .arguments = {{"page", "1..9", false}}, .reads_only = true}};
  static const Family kFamily = {.name = "plain", .summary = "for tests", .operations = kOperations};
  PendingCommand command = Lost("bump", S::REASON_DRIVER_RESTARTED);
  command.operation = &kOperations[0];
  const auto check = OutcomeCheckFor(command, kFamily, kGiveUp);
  ASSERT_TRUE(check);
  EXPECT_EQ(check->operation, &kOperations[1]);
  EXPECT_THAT(check->arguments, SizeIs(0));
}

TEST(OutcomeCheck, ALookThatWasNeverSentShowsThatTheDriverIsGone) {
  PendingCommand looked = Looked(S::STATE_EXPIRED, S::REASON_DEADLINE);
  for (const std::int64_t boot_id : {0, 1}) {
    looked.status.driver_boot_id = boot_id;
    S outcome{};
    AddCheckedOutcome(looked, outcome);
    if (boot_id == 0) {
      EXPECT_THAT(outcome.text, HasSubstr("the driver has not come back"));
    } else {
      EXPECT_THAT(outcome.text, HasSubstr("afterwards"));
    }
    EXPECT_EQ(outcome.finding, S::FINDING_CANNOT_TELL);
  }
}

TEST(OutcomeCheck, ItsTextIsNoLongerThanAText) {
  PendingCommand looked = Looked(S::STATE_SUCCEEDED, S::REASON_NONE);
  looked.status.text = std::string(kTextBytes, 'x');
  S outcome{};
  outcome.text = std::string(kTextBytes, 'y');
  AddCheckedOutcome(looked, outcome);
  EXPECT_LE(outcome.text.size(), kTextBytes);
}

// ---- after a restart of the bridge ----

TEST(OutcomeCheck, ARecoveredCommandHasAllThatWasStored) {
  MachineConfig machine;
  machine.buses = {CountingBus("b0", {"axis1"})};
  OpenCommand open;
  open.record.status.device = "axis1";
  open.record.status.operation = "write";
  const CommandId id = NumberedId(5);
  std::copy(id.begin(), id.end(), std::begin(open.record.status.id));
  open.record.arguments = {{"address", "3"}};
  open.record.who = "operator";
  open.record.reason = "because";
  const PendingCommand pending = RecoveredCommand(machine, open);
  EXPECT_EQ(pending.id, id);
  EXPECT_EQ(pending.device, "axis1");
  ASSERT_NE(pending.operation, nullptr);
  EXPECT_EQ(pending.operation->name, "write");
  EXPECT_THAT(pending.arguments, SizeIs(1));
  EXPECT_EQ(pending.who, "operator");
  EXPECT_EQ(pending.reason, "because");
  open.record.status.device = "axis9";
  EXPECT_EQ(RecoveredCommand(machine, open).operation, nullptr);
}

TEST(OutcomeCheck, WhatWasNeverSentIsRejectedAndWhatWasSentIndeterminate) {
  S unsent{};
  GiveUp(unsent, {kNow, 77});
  EXPECT_EQ(unsent.state, S::STATE_REJECTED);
  EXPECT_EQ(unsent.finding, S::FINDING_NONE);
  EXPECT_EQ(unsent.reason_code, S::REASON_BRIDGE_RESTARTED);
  EXPECT_EQ(unsent.finished_utime, 77);
  EXPECT_THAT(unsent.text, HasSubstr("nothing was done"));
  S sent{};
  sent.driver_boot_id = 7;
  GiveUp(sent, {kNow, 77});
  EXPECT_EQ(sent.state, S::STATE_INDETERMINATE);
  EXPECT_EQ(sent.finding, S::FINDING_CANNOT_TELL);
  EXPECT_THAT(sent.text, Not(HasSubstr("nothing was done")));
}

}  // namespace
}  // namespace axlecast
