#include "tools/axlecast/command_session.h"

#include <gtest/gtest.h>

#include <axlecast/command_body_t.hpp>

#include "drivers/runtime/command/body_digest.h"
#include "drivers/runtime/core/decode_message.h"
#include "tools/axlecast/command_client.h"

namespace axlecast {
namespace {

using S = command_status_t;

constexpr MonoNs kStart = 100 * kSecond;
constexpr CommandId kId = {1, 2, 3};

class CommandSessionTest : public testing::Test {
 protected:
  // The body sent at `now`; one of mode -1 when nothing is.
  command_body_t Sent(MonoNs now) {
    const auto bytes = session_.Next(now);
    command_body_t nothing{};
    nothing.mode = -1;
    if (!bytes) return nothing;
    sent_ = *bytes;
    return DecodeMessage<command_body_t>(*bytes).value_or(nothing);
  }
  bool Answer(MonoNs now, std::int8_t state, std::int64_t boot_id = 9, std::int8_t finding = 0) {
    S status{};
    std::copy(kId.begin(), kId.end(), std::begin(status.id));
    status.boot_id = boot_id;
    status.state = state;
    status.finding = finding;
    status.is_final = state >= S::STATE_SUCCEEDED ? 1 : 0;
    status.body_digest = state == S::STATE_UNKNOWN ? 0 : digest_;
    return session_.OnStatus(status, now);
  }
  // Has learned the bridge's boot id and sent its command at kStart.
  void SendIt() {
    Sent(kStart);
    Answer(kStart, S::STATE_UNKNOWN);
    ASSERT_EQ(Sent(kStart).mode, command_body_t::MODE_EXECUTE);
    digest_ = BodyDigest(sent_);
  }

  CommandSession session_{
      kId, {.device = "axis1", .operation = "zero", .arguments = {{"to", "0"}}}, kStart, kStart + 60 * kSecond};
  std::vector<std::uint8_t> sent_;
  std::int64_t digest_ = 0;
};

TEST_F(CommandSessionTest, LearnsTheBridgeThenSendsUntilAnswered) {
  auto body = Sent(kStart);
  EXPECT_EQ(body.mode, command_body_t::MODE_QUERY);
  EXPECT_EQ(body.bridge_boot_id, 0);
  EXPECT_EQ(Sent(kStart).mode, -1);
  EXPECT_EQ(Sent(kStart + 50 * kMillisecond).mode, command_body_t::MODE_QUERY);
  EXPECT_FALSE(Answer(kStart + 60 * kMillisecond, S::STATE_UNKNOWN));
  body = Sent(kStart + 60 * kMillisecond);
  EXPECT_EQ(body.mode, command_body_t::MODE_EXECUTE);
  EXPECT_EQ(body.bridge_boot_id, 9);
  EXPECT_EQ(body.device, "axis1");
  ASSERT_EQ(body.n_arguments, 1);
  EXPECT_EQ(body.arguments[0].value, "0");
  const auto first = sent_;
  EXPECT_EQ(Sent(kStart + 110 * kMillisecond).mode, command_body_t::MODE_EXECUTE);
  EXPECT_EQ(sent_, first);
}

TEST_F(CommandSessionTest, FollowsToTheOutcome) {
  SendIt();
  EXPECT_TRUE(Answer(kStart, S::STATE_ACCEPTED));
  EXPECT_FALSE(Answer(kStart, S::STATE_ACCEPTED));
  EXPECT_EQ(Sent(kStart + 499 * kMillisecond).mode, -1);
  EXPECT_EQ(Sent(kStart + 500 * kMillisecond).mode, command_body_t::MODE_QUERY);
  EXPECT_TRUE(Answer(kStart + kSecond, S::STATE_SUCCEEDED));
  EXPECT_TRUE(session_.done());
  EXPECT_TRUE(session_.result().problem.empty());
  EXPECT_EQ(Sent(kStart + 2 * kSecond).mode, -1);
}

TEST_F(CommandSessionTest, WaitsForTheFinding) {
  SendIt();
  EXPECT_TRUE(Answer(kStart, S::STATE_INDETERMINATE));
  EXPECT_FALSE(session_.done());
  EXPECT_FALSE(Answer(kStart, S::STATE_RUNNING));  // late
  EXPECT_TRUE(Answer(kStart, S::STATE_INDETERMINATE, 9, S::FINDING_EFFECT_SEEN));
  EXPECT_TRUE(session_.done());
  EXPECT_EQ(session_.result().status.finding, S::FINDING_EFFECT_SEEN);
}

TEST_F(CommandSessionTest, NoBridge) {
  EXPECT_EQ(Sent(kStart + 3 * kSecond).mode, command_body_t::MODE_QUERY);
  EXPECT_EQ(Sent(kStart + 3 * kSecond + 1).mode, -1);
  EXPECT_TRUE(session_.done());
  EXPECT_FALSE(session_.result().answered);
  EXPECT_EQ(ExitCode(session_.result()), 6);
}

TEST_F(CommandSessionTest, ABridgeThatRestartsLeavesTheOutcomeUnknown) {
  SendIt();
  Answer(kStart, S::STATE_RUNNING);
  EXPECT_FALSE(Answer(kStart + kSecond, S::STATE_REJECTED, 10));  // the new boot: STALE_BRIDGE
  EXPECT_FALSE(session_.done());
  Sent(kStart + 3 * kSecond + 1);
  EXPECT_TRUE(session_.done());
  EXPECT_EQ(ExitCode(session_.result()), 6);
  EXPECT_NE(session_.result().problem.find("restarted"), std::string::npos);
}

TEST_F(CommandSessionTest, TheAnswerToAnotherBodyIsNotOurs) {
  SendIt();
  digest_ += 1;
  EXPECT_FALSE(Answer(kStart, S::STATE_REJECTED));
  EXPECT_FALSE(session_.done());
}

TEST_F(CommandSessionTest, CancelsWhatWasAnswered) {
  SendIt();
  Answer(kStart, S::STATE_ACCEPTED);
  session_.Cancel(kStart + kSecond);
  EXPECT_EQ(Sent(kStart + kSecond).mode, command_body_t::MODE_CANCEL);
  EXPECT_EQ(Sent(kStart + kSecond + 50 * kMillisecond).mode, command_body_t::MODE_CANCEL);
  Answer(kStart + kSecond, S::STATE_CANCELLED);
  EXPECT_EQ(ExitCode(session_.result()), 3);
}

TEST_F(CommandSessionTest, CancelledBeforeItWasSentIsNeverSent) {
  session_.Cancel(kStart);
  EXPECT_TRUE(session_.done());
  EXPECT_EQ(Sent(kStart).mode, -1);
  EXPECT_EQ(ExitCode(session_.result()), 3);
}

TEST(CommandSession, AQueryTellsHowItStands) {
  auto session = CommandSession::Query(kId, kStart, kStart + kSecond);
  ASSERT_TRUE(session.Next(kStart));
  S status{};
  std::copy(kId.begin(), kId.end(), std::begin(status.id));
  status.state = S::STATE_UNKNOWN;
  EXPECT_TRUE(session.OnStatus(status, kStart));
  EXPECT_TRUE(session.done());
  EXPECT_FALSE(session.result().problem.empty());
  EXPECT_EQ(ExitCode(session.result()), 6);
}

// design.md, "JSON and exit codes".
TEST(CommandResult, ExitCodes) {
  CommandResult result;
  result.answered = true;
  const auto code = [&](std::int8_t state, std::int8_t verified) {
    result.status.state = state;
    result.status.verified = verified;
    result.status.is_final = 1;
    return ExitCode(result);
  };
  result.status = {};
  EXPECT_EQ(code(S::STATE_SUCCEEDED, 1), 0);
  EXPECT_EQ(code(S::STATE_SUCCEEDED, 0), 7);
  EXPECT_EQ(code(S::STATE_REJECTED, 0), 3);
  EXPECT_EQ(code(S::STATE_EXPIRED, 0), 3);
  EXPECT_EQ(code(S::STATE_CANCELLED, 0), 3);
  EXPECT_EQ(code(S::STATE_FAILED, 0), 4);
  EXPECT_EQ(code(S::STATE_INDETERMINATE, 0), 5);
  result.status.is_final = 0;
  EXPECT_EQ(ExitCode(result), 6);
}

TEST(CommandResult, JsonIsFlatWithWords) {
  CommandResult result;
  result.id = kId;
  EXPECT_EQ(ToJson(result).dump(), R"({"outcome":"unknown","id":"01020300000000000000000000000000"})");
  result.answered = true;
  result.status = {};
  result.status.state = S::STATE_INDETERMINATE;
  result.status.is_final = 1;
  result.status.finding = S::FINDING_CANNOT_TELL;
  result.status.reason_code = S::REASON_DRIVER_RESTARTED;
  result.status.driver_boot_id = 255;
  const auto json = ToJson(result);
  EXPECT_EQ(json["outcome"], "indeterminate");
  EXPECT_EQ(json["reason"], "driver_restarted");
  EXPECT_EQ(json["found"], "cannot_tell");
  EXPECT_EQ(json["id"], "01020300000000000000000000000000");
  EXPECT_EQ(json["driver_boot_id"], "00000000000000ff");
}

TEST(CommandResult, TextNamesOutcomeChangesAndProblem) {
  CommandResult result;
  result.answered = true;
  result.status = {};
  result.status.device = "axis1";
  result.status.operation = "zero";
  result.status.state = S::STATE_SUCCEEDED;
  result.status.is_final = result.status.verified = 1;
  result.status.text = "reads 0 \x1B[31m";
  result.status.changes = {{"counts", "1234", "0"}};
  EXPECT_EQ(ToText(result), "axis1 zero: SUCCEEDED, verified: reads 0 ?[31m\n  counts: 1234 -> 0\n");
}

}  // namespace
}  // namespace axlecast
