#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/axlecast/command/command_run.h"

namespace axlecast {
namespace {

using testing::HasSubstr;
using S = command_status_t;

constexpr CommandId kId = {1, 2, 3};

CommandResult Ended(std::int8_t state, std::int32_t reason = S::REASON_NONE) {
  CommandResult result;
  result.id = kId;
  result.answered = true;
  result.status.device = "axis1";
  result.status.operation = "zero";
  result.status.state = state;
  result.status.is_final = 1;
  result.status.reason_code = reason;
  return result;
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

TEST(CommandResult, TemporaryIsToldApartFromDenied) {
  const CommandResult busy = Ended(S::STATE_REJECTED, S::REASON_BUSY);
  EXPECT_EQ(ToJson(busy)["temporary"], true);
  EXPECT_THAT(ToText(busy), HasSubstr("may be accepted later"));
  const CommandResult denied = Ended(S::STATE_REJECTED, S::REASON_DENIED);
  EXPECT_EQ(ToJson(denied)["temporary"], false);
  EXPECT_THAT(ToText(denied), HasSubstr("refused again"));
  EXPECT_FALSE(ToJson(Ended(S::STATE_FAILED, S::REASON_BUSY)).contains("temporary"));
}

TEST(CommandResult, WhatNoBridgeAcceptedIsNotUnknown) {
  CommandResult result;
  result.id = kId;
  result.not_accepted = true;
  result.can_resend = true;
  result.problem = "no bridge answers";
  EXPECT_EQ(ExitCode(result), 6);
  EXPECT_EQ(ToJson(result).dump(), R"({"outcome":"not_accepted","temporary":true,"problem":"no bridge answers",)"
                                   R"("id":"01020300000000000000000000000000"})");
}

TEST(CommandResult, PreparedShowsTheTokenAndIsDone) {
  CommandResult result = Ended(S::STATE_SUCCEEDED);
  result.prepare = true;
  result.status.token[15] = 0xAB;
  EXPECT_EQ(ExitCode(result), 0);
  EXPECT_EQ(ToJson(result)["outcome"], "prepared");
  EXPECT_EQ(ToJson(result)["token"], "000000000000000000000000000000ab");
  EXPECT_THAT(ToText(result), HasSubstr("--commit 000000000000000000000000000000ab"));
  result.status.state = S::STATE_REJECTED;
  EXPECT_EQ(ExitCode(result), 3);
}

}  // namespace

}  // namespace axlecast
