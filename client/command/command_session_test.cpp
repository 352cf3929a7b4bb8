#include "client/command/command_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <axlecast/command_body_t.hpp>
#include <axlecast/command_t.hpp>
#include <map>
#include <vector>

#include "client/command/session_test_support.h"
#include "core/messages/message.h"
#include "tests/support/fake_clock.h"
#include "tests/support/memory_sink.h"

namespace axlecast {
namespace {

class CommandSessionTest : public testing::Test, protected SessionFixture {
 protected:
  CommandSessionTest() : SessionFixture({.device = "axis1", .operation = "zero", .arguments = {{"to", "0"}}}) {}
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

// Validity counts from this instant: it must not restart with each repetition.
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
  SessionFixture prepares({.device = "axis1", .operation = "zero", .prepare = true});
  prepares.SendIt();
  EXPECT_EQ(DecodeMessage<command_body_t>(prepares.sent_.bytes)->mode, command_body_t::MODE_PREPARE);
  S status = prepares.Status(kStart, S::STATE_SUCCEEDED);
  status.token[0] = 7;
  EXPECT_TRUE(prepares.session_.OnStatus(status, kStart));
  const CommandResult result = prepares.session_.result();
  EXPECT_EQ(result.outcome(), CommandOutcome::kPrepared);
  EXPECT_EQ(result.token(), (CommandToken{7}));

  SessionFixture commits({.device = "axis1", .operation = "zero", .token = result.token()});
  commits.SendIt();
  const auto body = DecodeMessage<command_body_t>(commits.sent_.bytes);
  ASSERT_TRUE(body);
  EXPECT_EQ(body->mode, command_body_t::MODE_COMMIT);
  EXPECT_EQ(body->token[0], 7);
}

TEST(CommandSessionModes, APrepareThatIsRefusedIsRejected) {
  SessionFixture fixture({.device = "axis1", .operation = "zero", .prepare = true});
  fixture.SendIt();
  S status = fixture.Status(kStart, S::STATE_REJECTED);
  status.reason_code = S::REASON_NOT_STANDING_STILL;
  EXPECT_TRUE(fixture.session_.OnStatus(status, kStart));
  EXPECT_EQ(fixture.session_.result().outcome(), CommandOutcome::kRejected);
  EXPECT_TRUE(fixture.session_.result().temporary());
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

using Kind = CommandSessions::Kind;
using S = command_status_t;

CommandId Id(int number) {
  CommandId id{};
  id[0] = static_cast<std::uint8_t>(number & 255);
  id[1] = static_cast<std::uint8_t>(number >> 8);
  return id;
}

std::vector<std::uint8_t> Encoded(const CommandId& id, std::int8_t state, std::int64_t digest = 0) {
  S status{};
  std::copy(id.begin(), id.end(), std::begin(status.id));
  status.boot_id = 9;
  status.state = state;
  status.is_final = state >= S::STATE_SUCCEEDED ? 1 : 0;
  status.body_digest = digest;
  status.device = "axis1";
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(status.getEncodedSize()));
  status.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

class CommandSessionsTest : public testing::Test {
 protected:
  [[nodiscard]] const CommandResult& Result(const CommandId& id) const {
    return sessions_.Find({Kind::kCommand, id})->result();
  }

  FakeClock clock_;
  MemorySink sink_;
  CommandSessions sessions_{clock_, sink_, Origin{.boot_id = 77}, {}};
};

TEST_F(CommandSessionsTest, ManyAreUnderWayAndEachHearsItsOwn) {
  sessions_.Send(Id(1), {.device = "axis1", .operation = "zero"});
  sessions_.Send(Id(2), {.device = "axis2", .operation = "zero"});
  EXPECT_EQ(sessions_.Poll(), clock_.Now() + CommandSession::kRepeat);
  EXPECT_EQ(sink_.All<command_t>("COMMAND").size(), 2U);
  sessions_.OnStatus(Encoded(Id(2), S::STATE_UNKNOWN), nullptr);
  sink_.Clear();
  static_cast<void>(sessions_.Poll());
  const auto sent = sink_.All<command_t>("COMMAND");
  ASSERT_EQ(sent.size(), 1U);
  EXPECT_EQ(sent[0].seq, 2);
  EXPECT_EQ(sent[0].boot_id, 77);
  EXPECT_EQ(DecodeMessage<command_body_t>(sent[0].body)->device, "axis2");
}

TEST_F(CommandSessionsTest, WhatDoesNotFitIsRefusedAndNeverCutOff) {
  const std::vector<CommandRequest> wrong = {
      {.device = "axis1", .operation = "zero", .valid_ms = 0},
      {.device = "axis1", .operation = "zero", .valid_ms = 3'600'001},
      {.device = std::string("axis1\0x", 7), .operation = "zero"},
      {.device = "axis1", .operation = "zero", .reason = std::string(161, 'x')},
      {.device = "axis1", .operation = "zero", .arguments = {17, {"key", "value"}}},
      {.device = "axis1", .operation = "zero", .arguments = {8, {"key", std::string(160, 'x')}}},
      {.device = "axis1", .operation = "zero", .prepare = true, .token = CommandToken{}},
  };
  for (std::size_t i = 0; i < wrong.size(); ++i) {
    const CommandId id = Id(static_cast<int>(i));
    sessions_.Send(id, wrong[i]);
    EXPECT_EQ(Result(id).outcome(), CommandOutcome::kNotAccepted) << i;
    EXPECT_FALSE(Result(id).temporary()) << i;
  }
  static_cast<void>(sessions_.Poll());
  EXPECT_TRUE(sink_.All<command_t>("COMMAND").empty());
}

TEST_F(CommandSessionsTest, TheNewestThatEndedAreKept) {
  const int many = static_cast<int>(CommandSessions::kKept) + 10;
  for (int i = 0; i < many; ++i) {
    sessions_.Refuse(Id(i), {}, "no port");
    EXPECT_EQ(sessions_.Poll(), kNever);
  }
  EXPECT_EQ(sessions_.Find({Kind::kCommand, Id(9)}), nullptr);
  EXPECT_EQ(Result(Id(10)).problem, "no port");
}

TEST_F(CommandSessionsTest, NoMoreUnderWayThanTheirNumberAllows) {
  const int maximum = static_cast<int>(CommandSessions::kMaxOpen);
  for (int i = 0; i <= maximum; ++i) sessions_.Send(Id(i), {.device = "axis1", .operation = "zero"});
  EXPECT_FALSE(sessions_.Find({Kind::kCommand, Id(maximum - 1)})->done());
  EXPECT_TRUE(Result(Id(maximum)).temporary());
}

TEST_F(CommandSessionsTest, ACommandAndAQueryForItMayBeUnderWayTogether) {
  sessions_.Send(Id(1), {.device = "axis1", .operation = "zero"});
  sessions_.Query(Id(1), Id(7));
  int told = 0;
  const auto tell = [&told](const CommandResult&) { ++told; };
  sessions_.OnStatus(Encoded(Id(1), S::STATE_SUCCEEDED), tell);
  static_cast<void>(sessions_.Poll(tell));
  EXPECT_TRUE(sessions_.Find({Kind::kQuery, Id(1)})->done());
  EXPECT_FALSE(sessions_.Find({Kind::kCommand, Id(1)})->done());
  EXPECT_EQ(told, 0);
  sessions_.Query(Id(1), Id(8));  // once more
  EXPECT_FALSE(sessions_.Find({Kind::kQuery, Id(1)})->done());
}

// A session that ends without a status ends as visibly as one that the bridge ended.
TEST_F(CommandSessionsTest, EveryEndIsReportedOnce) {
  std::map<CommandId, std::vector<CommandOutcome>> ends;
  const auto tell = [&ends](const CommandResult& result) {
    EXPECT_EQ(result.status.device, "axis1");
    if (!result.under_way) ends[result.id].push_back(result.outcome());
  };
  const CommandRequest zero = {.device = "axis1", .operation = "zero"};
  sessions_.Send(Id(1), {.device = "axis1", .operation = "zero", .valid_ms = 0});
  sessions_.Send(Id(2), zero);
  sessions_.Cancel(Id(2));
  sessions_.Refuse(Id(3), zero, "no port");
  sessions_.Send(Id(4), zero);  // no bridge answers
  sessions_.Send(Id(5), zero);  // the bridge falls silent
  sessions_.Send(Id(6), zero);  // the bridge succeeds
  static_cast<void>(sessions_.Poll(tell));
  const auto learned = [&](int id) { sessions_.OnStatus(Encoded(Id(id), S::STATE_UNKNOWN), tell); };
  learned(5);
  learned(6);
  sink_.Clear();
  static_cast<void>(sessions_.Poll(tell));
  for (const command_t& sent : sink_.All<command_t>("COMMAND")) {
    if (DecodeMessage<command_body_t>(sent.body)->id[0] == 6) {
      sessions_.OnStatus(Encoded(Id(6), S::STATE_SUCCEEDED, BodyDigest(sent.body)), tell);
    }
  }
  for (int i = 0; i < 20; ++i) {
    static_cast<void>(sessions_.Poll(tell));
    clock_.Advance(kSecond);
  }
  using Outcomes = std::vector<CommandOutcome>;
  EXPECT_EQ(ends[Id(1)], Outcomes{CommandOutcome::kNotAccepted});
  EXPECT_EQ(ends[Id(2)], Outcomes{CommandOutcome::kCancelled});
  EXPECT_EQ(ends[Id(3)], Outcomes{CommandOutcome::kNotAccepted});
  EXPECT_EQ(ends[Id(4)], Outcomes{CommandOutcome::kNotAccepted});
  EXPECT_EQ(ends[Id(5)], Outcomes{CommandOutcome::kUnknown});
  EXPECT_EQ(ends[Id(6)], Outcomes{CommandOutcome::kDoneUnverified});
}

TEST_F(CommandSessionsTest, APortThatFailsEndsWhatIsUnderWay) {
  sessions_.Send(Id(1), {.device = "axis1", .operation = "zero"});
  sessions_.Send(Id(2), {.device = "axis1", .operation = "zero"});
  static_cast<void>(sessions_.Poll());
  sessions_.OnStatus(Encoded(Id(2), S::STATE_UNKNOWN), nullptr);
  static_cast<void>(sessions_.Poll());
  sessions_.EndAll("the port failed");
  EXPECT_EQ(Result(Id(1)).outcome(), CommandOutcome::kNotAccepted);
  EXPECT_EQ(Result(Id(2)).outcome(), CommandOutcome::kUnknown) << "it was sent";
  EXPECT_EQ(sessions_.Poll(), kNever);
}

TEST_F(CommandSessionsTest, WhatIsNoStatusIsIgnored) {
  sessions_.Send(Id(1), {.device = "axis1", .operation = "zero"});
  auto bytes = Encoded(Id(1), S::STATE_UNKNOWN);
  bytes.pop_back();
  sessions_.OnStatus(bytes, nullptr);
  sessions_.OnStatus({}, nullptr);
  static_cast<void>(sessions_.Poll());
  for (const command_t& sent : sink_.All<command_t>("COMMAND")) {
    EXPECT_EQ(DecodeMessage<command_body_t>(sent.body)->mode, command_body_t::MODE_QUERY);
  }
}

}  // namespace

}  // namespace axlecast
