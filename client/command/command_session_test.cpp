#include "client/command/command_session.h"

#include <gtest/gtest.h>

#include <axlecast/command_body_t.hpp>

#include "client/command/session_test_support.h"

namespace axlecast {
namespace {

class CommandSessionTest : public testing::Test, protected SessionBench {
 protected:
  CommandSessionTest() : SessionBench({.device = "axis1", .operation = "zero", .arguments = {{"to", "0"}}}) {}
};

TEST_F(CommandSessionTest, LearnsTheBridgeThenSendsUntilAnswered) {
  auto body = Sent(kStart);
  EXPECT_EQ(body.mode, command_body_t::MODE_QUERY);
  EXPECT_EQ(body.bridge_boot_id, 0);
  EXPECT_EQ(body.issued_mono_ns, 0);
  EXPECT_EQ(Sent(kStart).mode, -1);
  EXPECT_EQ(session_.NextAt(), kStart + 50 * kMillisecond);
  EXPECT_EQ(Sent(kStart + 50 * kMillisecond).mode, command_body_t::MODE_QUERY);
  EXPECT_FALSE(Answer(kStart + 60 * kMillisecond, S::STATE_UNKNOWN));
  body = Sent(kStart + 60 * kMillisecond);
  EXPECT_EQ(body.mode, command_body_t::MODE_EXECUTE);
  EXPECT_EQ(body.bridge_boot_id, kBoot);
  EXPECT_EQ(body.device, "axis1");
  ASSERT_EQ(body.n_arguments, 1);
  EXPECT_EQ(body.arguments[0].value, "0");
  EXPECT_EQ(body.key_id, 0);
}

// Validity counts from this instant: it must not begin anew with each repetition.
TEST_F(CommandSessionTest, IssuedByTheBridgesClockAndRepeatedUnchanged) {
  Sent(kStart);
  Answer(kStart + 7 * kMillisecond, S::STATE_UNKNOWN);
  const auto body = Sent(kStart + 7 * kMillisecond);
  EXPECT_EQ(body.issued_mono_ns, kStart + 7 * kMillisecond + kBridgeAhead);
  const auto first = sent_.bytes;
  Answer(kStart + 40 * kMillisecond, S::STATE_UNKNOWN);  // late
  EXPECT_EQ(Sent(kStart + 57 * kMillisecond).mode, command_body_t::MODE_EXECUTE);
  EXPECT_EQ(sent_.bytes, first);
}

TEST_F(CommandSessionTest, FollowsToTheOutcome) {
  SendIt();
  EXPECT_TRUE(Answer(kStart, S::STATE_ACCEPTED));
  EXPECT_FALSE(Answer(kStart, S::STATE_ACCEPTED));
  EXPECT_EQ(Sent(kStart + 499 * kMillisecond).mode, -1);
  EXPECT_EQ(Sent(kStart + 500 * kMillisecond).mode, command_body_t::MODE_QUERY);
  EXPECT_TRUE(Answer(kStart + kSecond, S::STATE_SUCCEEDED));
  EXPECT_TRUE(session_.done());
  EXPECT_EQ(session_.NextAt(), kNever);
  EXPECT_TRUE(session_.result().problem.empty());
  EXPECT_EQ(Sent(kStart + 2 * kSecond).mode, -1);
}

TEST_F(CommandSessionTest, AStatusThatWasOvertakenIsNoNews) {
  SendIt();
  EXPECT_TRUE(Answer(kStart, S::STATE_ACCEPTED));
  S late = Status(kStart, S::STATE_ACCEPTED);
  EXPECT_TRUE(Answer(kStart, S::STATE_RUNNING));
  late.text = "waits";
  EXPECT_FALSE(session_.OnStatus(late, kStart));
  EXPECT_EQ(session_.result().status.state, S::STATE_RUNNING);
}

TEST_F(CommandSessionTest, WaitsForTheFinding) {
  SendIt();
  EXPECT_TRUE(Answer(kStart, S::STATE_INDETERMINATE));
  EXPECT_FALSE(session_.done());
  EXPECT_FALSE(Answer(kStart, S::STATE_RUNNING));
  S found = Status(kStart, S::STATE_INDETERMINATE);
  found.finding = S::FINDING_EFFECT_SEEN;
  EXPECT_TRUE(session_.OnStatus(found, kStart));
  EXPECT_TRUE(session_.done());
  EXPECT_EQ(session_.result().status.finding, S::FINDING_EFFECT_SEEN);
}

TEST_F(CommandSessionTest, AFindingThatDoesNotComeIsNotAwaitedForEver) {
  SendIt();
  Answer(kStart, S::STATE_INDETERMINATE);
  for (MonoNs now = kStart; now < kStart + CommandSession::kFindingWait; now += kSecond) {
    Answer(now, S::STATE_INDETERMINATE);
    Sent(now);
    ASSERT_FALSE(session_.done());
  }
  Sent(kStart + CommandSession::kFindingWait);
  EXPECT_TRUE(session_.done());
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kIndeterminate);
}

TEST_F(CommandSessionTest, NoBridge) {
  EXPECT_EQ(Sent(kStart + 3 * kSecond).mode, command_body_t::MODE_QUERY);
  EXPECT_EQ(Sent(kStart + 3 * kSecond + 1).mode, -1);
  EXPECT_TRUE(session_.done());
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kNotAccepted);
  EXPECT_TRUE(session_.result().temporary());
}

// It may have been done: that is never the same as "not accepted" or "failed".
TEST_F(CommandSessionTest, ABridgeThatFallsSilentLeavesItUnknown) {
  SendIt();
  Sent(kStart + CommandSession::kBridgeSilence);
  EXPECT_FALSE(session_.done());
  Sent(kStart + CommandSession::kBridgeSilence + 1);
  EXPECT_TRUE(session_.done());
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kUnknown);
  EXPECT_FALSE(session_.result().temporary());
  EXPECT_FALSE(session_.result().problem.empty());
}

TEST_F(CommandSessionTest, TheAnswerToAnotherBodyIsNotOurs) {
  SendIt();
  S other = Status(kStart, S::STATE_REJECTED);
  other.body_digest += 1;
  EXPECT_FALSE(session_.OnStatus(other, kStart));
  EXPECT_FALSE(session_.done());
}

TEST_F(CommandSessionTest, CancelsWhatWasAnswered) {
  SendIt();
  Answer(kStart, S::STATE_ACCEPTED);
  session_.Cancel(kStart + kSecond);
  const auto body = Sent(kStart + kSecond);
  EXPECT_EQ(body.mode, command_body_t::MODE_CANCEL);
  EXPECT_EQ(body.bridge_boot_id, kBoot);
  EXPECT_EQ(body.issued_mono_ns, kStart + kSecond + kBridgeAhead);
  EXPECT_EQ(Sent(kStart + kSecond + 50 * kMillisecond).mode, command_body_t::MODE_CANCEL);
  Answer(kStart + kSecond, S::STATE_CANCELLED);
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kCancelled);
}

TEST_F(CommandSessionTest, CancelledBeforeItWasSentIsNeverSent) {
  session_.Cancel(kStart);
  EXPECT_TRUE(session_.done());
  EXPECT_EQ(Sent(kStart).mode, -1);
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kCancelled);
}

// -- two steps

TEST(CommandSessionModes, PreparesAndCommits) {
  SessionBench prepares({.device = "axis1", .operation = "zero", .prepare = true});
  prepares.SendIt();
  EXPECT_EQ(DecodeMessage<command_body_t>(prepares.sent_.bytes)->mode, command_body_t::MODE_PREPARE);
  S status = prepares.Status(kStart, S::STATE_SUCCEEDED);
  status.token[0] = 7;
  EXPECT_TRUE(prepares.session_.OnStatus(status, kStart));
  const CommandResult result = prepares.session_.result();
  EXPECT_EQ(result.outcome(), CommandOutcome::kPrepared);
  EXPECT_EQ(result.token(), (CommandToken{7}));

  SessionBench commits({.device = "axis1", .operation = "zero", .token = result.token()});
  commits.SendIt();
  const auto body = DecodeMessage<command_body_t>(commits.sent_.bytes);
  ASSERT_TRUE(body);
  EXPECT_EQ(body->mode, command_body_t::MODE_COMMIT);
  EXPECT_EQ(body->token[0], 7);
}

TEST(CommandSessionModes, APrepareThatIsRefusedIsRejected) {
  SessionBench bench({.device = "axis1", .operation = "zero", .prepare = true});
  bench.SendIt();
  S status = bench.Status(kStart, S::STATE_REJECTED);
  status.reason_code = S::REASON_NOT_STANDING_STILL;
  EXPECT_TRUE(bench.session_.OnStatus(status, kStart));
  EXPECT_EQ(bench.session_.result().outcome(), CommandOutcome::kRejected);
  EXPECT_TRUE(bench.session_.result().temporary());
}

// -- queries

CommandSession Query(const ClientKeys& keys) { return CommandSession::Query(kId, {9, 9}, keys, kStart); }

S StatusFor(const CommandId& id, std::int8_t state, MonoNs mono = kStart) {
  S status{};
  std::copy(id.begin(), id.end(), std::begin(status.id));
  status.boot_id = kBoot;
  status.mono_ns = mono;
  status.state = state;
  status.is_final = state >= S::STATE_SUCCEEDED ? 1 : 0;
  return status;
}

TEST(CommandSessionQuery, TellsHowItStands) {
  CommandSession session = Query({});
  ASSERT_TRUE(session.Next(kStart));
  EXPECT_TRUE(session.OnStatus(StatusFor(kId, S::STATE_FAILED), kStart));
  EXPECT_TRUE(session.done());
  EXPECT_EQ(session.result().outcome(), CommandOutcome::kFailed);
}

TEST(CommandSessionQuery, AnIdThatTheBridgeDoesNotKnowIsUnknown) {
  CommandSession session = Query({});
  EXPECT_TRUE(session.OnStatus(StatusFor(kId, S::STATE_UNKNOWN), kStart));
  EXPECT_TRUE(session.done());
  EXPECT_FALSE(session.result().problem.empty());
  EXPECT_EQ(session.result().outcome(), CommandOutcome::kUnknown);
}

// A recorded "unknown id" would make somebody send it again.
TEST(CommandSessionQuery, WhatTheBridgeSignedEarlierIsNotBelieved) {
  const SigningKey bridge = SigningKey::Generate();
  CommandSession session = Query({nullptr, bridge.public_key()});
  S replayed = StatusFor(kId, S::STATE_UNKNOWN, kStart - kSecond);
  SignMessage(bridge, Domain::kStatus, replayed);
  EXPECT_FALSE(session.OnStatus(replayed, kStart));
  S probe = StatusFor({9, 9}, S::STATE_UNKNOWN);
  SignMessage(bridge, Domain::kStatus, probe);
  EXPECT_FALSE(session.OnStatus(probe, kStart));
  EXPECT_FALSE(session.OnStatus(replayed, kStart));
  EXPECT_FALSE(session.done());
  const auto asks = session.Next(kStart);
  ASSERT_TRUE(asks);
  EXPECT_EQ(DecodeMessage<command_body_t>(asks->bytes)->id[0], kId[0]);
  S fresh = StatusFor(kId, S::STATE_SUCCEEDED, kStart + kMillisecond);
  SignMessage(bridge, Domain::kStatus, fresh);
  EXPECT_TRUE(session.OnStatus(fresh, kStart));
  EXPECT_EQ(session.result().outcome(), CommandOutcome::kDoneUnverified);
}

TEST(CommandSessionQuery, NobodyAnswers) {
  CommandSession session = Query({});
  static_cast<void>(session.Next(kStart + CommandSession::kNoBridge + 1));
  EXPECT_TRUE(session.done());
  EXPECT_EQ(session.result().outcome(), CommandOutcome::kUnknown);  // it may have been done long ago
}

}  // namespace
}  // namespace axlecast
