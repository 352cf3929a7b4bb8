#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/command/session_test_support.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kNewBoot = 10;
constexpr MonoNs kLater = kStart + 2 * kSecond;

class CommandSessionRestart : public testing::Test, protected SessionFixture {
 protected:
  CommandSessionRestart() : SessionFixture({.device = "axis1", .operation = "zero"}) {}

  // What is sent from `from` on, each 50 ms; the bridge of `boot_id` answers each with `state`.
  void Serve(MonoNs from, MonoNs to, std::int64_t boot_id, std::int8_t state) {
    for (MonoNs now = from; now <= to && !session_.done(); now += 50 * kMillisecond) {
      const auto body = Sent(now);
      if (body.mode == command_body_t::MODE_QUERY) Answer(now, state, boot_id);
      if (body.mode == command_body_t::MODE_EXECUTE) RefuseAsStale(now, boot_id);
      ASSERT_TRUE(std::equal(kId.begin(), kId.end(), std::begin(body.id)) || body.mode == -1);
    }
  }
};

TEST_F(CommandSessionRestart, TheNewBootThatKnowsItIsFollowed) {
  SendIt();
  Answer(kStart, S::STATE_ROUTED);
  EXPECT_FALSE(Answer(kLater, S::STATE_ROUTED, kNewBoot));  // no news, but of the new boot
  EXPECT_TRUE(Answer(kLater, S::STATE_RUNNING, kNewBoot));
  EXPECT_FALSE(Answer(kLater, S::STATE_ROUTED));  // of the old one, late
  session_.Cancel(kLater);
  EXPECT_EQ(Sent(kLater).bridge_boot_id, kNewBoot);
  EXPECT_TRUE(Answer(kLater, S::STATE_SUCCEEDED, kNewBoot));
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kDoneUnverified);
}

// Its repetition names the old boot, so the new one refuses it; the journal may know it all the same.
TEST_F(CommandSessionRestart, AStaleCommandIsAskedForAndNeverSentAgain) {
  SendIt();
  ASSERT_FALSE(RefuseAsStale(kLater, kNewBoot));
  EXPECT_FALSE(session_.done());
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(Sent(kLater + i * CommandSession::kRepeat).mode, command_body_t::MODE_QUERY);
  }
  EXPECT_TRUE(Answer(kLater + kSecond, S::STATE_EXPIRED, kNewBoot));
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kExpired);
}

TEST_F(CommandSessionRestart, NeverAcceptedByEither) {
  SendIt();
  Serve(kLater, kLater + 2 * kSecond, kNewBoot, S::STATE_UNKNOWN);
  ASSERT_TRUE(session_.done());
  EXPECT_FALSE(session_.result().answered);
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kNotAccepted);
  EXPECT_TRUE(session_.result().temporary());
  EXPECT_THAT(session_.result().problem, HasSubstr("nothing was done; send it again"));
}

// A bridge that journals refusals answers a query with the refusal.
TEST_F(CommandSessionRestart, NeverAcceptedAndTheRefusalIsRemembered) {
  SendIt();
  for (MonoNs now = kLater; now < kLater + 2 * kSecond && !session_.done(); now += 50 * kMillisecond) {
    Sent(now);
    RefuseAsStale(now, kNewBoot);
  }
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kNotAccepted);
}

TEST_F(CommandSessionRestart, WhatWasAcceptedAndIsGoneIsUnknown) {
  SendIt();
  Answer(kStart, S::STATE_RUNNING);
  Serve(kLater, kLater + 2 * kSecond, kNewBoot, S::STATE_UNKNOWN);
  ASSERT_TRUE(session_.done());
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kUnknown);
  EXPECT_FALSE(session_.result().temporary());
  EXPECT_THAT(session_.result().problem, HasSubstr("look at the device"));
}

// The old boot still lives: a second bridge that does not know the id proves nothing.
TEST_F(CommandSessionRestart, ASecondBridgeIsNotBelieved) {
  SendIt();
  for (MonoNs now = kLater; now < kLater + 5 * kSecond; now += 50 * kMillisecond) {
    Sent(now);
    Answer(now, S::STATE_UNKNOWN, kNewBoot);
    Answer(now, S::STATE_UNKNOWN);  // of the old boot, which has not received the command
    ASSERT_FALSE(session_.done());
  }
  EXPECT_EQ(Sent(kLater + 6 * kSecond).mode, command_body_t::MODE_EXECUTE);
  EXPECT_TRUE(Answer(kLater + 6 * kSecond, S::STATE_ACCEPTED));
}

TEST_F(CommandSessionRestart, TwoRestarts) {
  SendIt();
  Answer(kStart, S::STATE_ROUTED);
  EXPECT_TRUE(Answer(kLater, S::STATE_RUNNING, kNewBoot));
  EXPECT_TRUE(Answer(kLater + kSecond, S::STATE_INDETERMINATE, 11));
  EXPECT_FALSE(Answer(kLater + kSecond, S::STATE_SUCCEEDED, kNewBoot));
  EXPECT_EQ(session_.result().status.state, S::STATE_INDETERMINATE);
}

TEST_F(CommandSessionRestart, ABridgeThatStaysAwayLeavesItUnknown) {
  SendIt();
  Sent(kStart + CommandSession::kBridgeSilence + 1);
  EXPECT_EQ(session_.result().outcome(), CommandOutcome::kUnknown);
}

// -- whom it believes

class CommandSessionKeys : public testing::Test {
 protected:
  CommandSessionKeys() { keys_.bridge = bridge_.public_key(); }

  const SigningKey bridge_ = SigningKey::Generate();
  ClientKeys keys_{std::make_shared<const SigningKey>(SigningKey::Generate()), std::nullopt};
};

TEST_F(CommandSessionKeys, SignsWhatItSends) {
  SessionFixture fixture({.device = "axis1", .operation = "zero"}, keys_);
  S status = fixture.Status(kStart, S::STATE_UNKNOWN);
  SignMessage(bridge_, Domain::kStatus, status);
  fixture.Sent(kStart);
  fixture.session_.OnStatus(status, kStart);
  const auto body = fixture.Sent(kStart);
  EXPECT_EQ(body.key_id, KeyId(keys_.own->public_key()));
  EXPECT_TRUE(Verify(keys_.own->public_key(), Domain::kCommand, fixture.sent_.bytes, fixture.sent_.signature));
  EXPECT_FALSE(Verify(keys_.own->public_key(), Domain::kPermit, fixture.sent_.bytes, fixture.sent_.signature));
}

TEST_F(CommandSessionKeys, UnsignedAndForeignStatusesAreCountedAndIgnored) {
  SessionFixture fixture({.device = "axis1", .operation = "zero"}, keys_);
  fixture.Sent(kStart);
  EXPECT_FALSE(fixture.Answer(kStart, S::STATE_UNKNOWN));
  S status = fixture.Status(kStart, S::STATE_UNKNOWN);
  SignMessage(SigningKey::Generate(), Domain::kStatus, status);
  fixture.session_.OnStatus(status, kStart);
  SignMessage(bridge_, Domain::kStatus, status);
  status.mono_ns += 1;  // altered
  fixture.session_.OnStatus(status, kStart);
  EXPECT_EQ(fixture.session_.unauthorized(), 3);
  EXPECT_EQ(fixture.Sent(kStart + kSecond).mode, command_body_t::MODE_QUERY);
  fixture.Sent(kStart + CommandSession::kNoBridge + 1);
  EXPECT_EQ(fixture.session_.result().outcome(), CommandOutcome::kNotAccepted);
  EXPECT_THAT(fixture.session_.result().problem,
              HasSubstr("their signature does not fit the bridge key of the machine's file"));
}

TEST_F(CommandSessionKeys, AForgedOutcomeIsNone) {
  SessionFixture fixture({.device = "axis1", .operation = "zero"}, keys_);
  S status = fixture.Status(kStart, S::STATE_UNKNOWN);
  SignMessage(bridge_, Domain::kStatus, status);
  fixture.Sent(kStart);
  fixture.session_.OnStatus(status, kStart);
  fixture.Sent(kStart);
  fixture.digest_ = BodyDigest(fixture.sent_.bytes);
  EXPECT_FALSE(fixture.Answer(kStart, S::STATE_SUCCEEDED));
  EXPECT_FALSE(fixture.session_.done());
  S outcome = fixture.Status(kStart, S::STATE_SUCCEEDED);
  SignMessage(bridge_, Domain::kStatus, outcome);
  EXPECT_TRUE(fixture.session_.OnStatus(outcome, kStart));
}

}  // namespace
}  // namespace axlecast
