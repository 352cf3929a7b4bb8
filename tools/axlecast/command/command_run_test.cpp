#include "tools/axlecast/command/command_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/monitor/test_one_axis.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

const std::vector<OperationSpec>& Operations() {
  static const std::vector<OperationSpec> operations = {
      {.name = "zero", .help = "sets zero", .arguments = {}, .destructive = true, .verification = "a reading"},
      {.name = "read",
       .help = "reads",
       .arguments = {{"address", "0..79"}, {"count", "1..80", false}},
       .verification = ""}};
  return operations;
}

MachineConfig Machine() {
  static const Family family = [] {
    Family made;
    made.name = "made_up";
    made.operations = Operations();
    return made;
  }();
  return OneAxis(&family);
}

TEST(FindOperation, AMonitorHasNoDatum) {
  static const Family monitor{.name = "monitor", .summary = "", .has_position = false, .operations = Operations()};
  EXPECT_TRUE(FindOperation(OneAxis(&monitor), "axis1", "read").has_value());
  EXPECT_THAT(FindOperation(OneAxis(&monitor), "axis1", "set_datum").error().text, HasSubstr("no operation"));
}

TEST(FindOperation, FindsTheFamilysAndTheRuntimes) {
  const MachineConfig machine = Machine();
  const auto zero = FindOperation(machine, "axis1", "zero");
  ASSERT_TRUE(zero.has_value());
  EXPECT_TRUE(zero->operation->destructive);
  EXPECT_TRUE(FindOperation(machine, "axis1", "set_datum").has_value());
}

TEST(FindOperation, NamesWhatIsValid) {
  const MachineConfig machine = Machine();
  EXPECT_THAT(FindOperation(machine, "axis2", "zero").error().text, HasSubstr("devices: axis1"));
  const std::string problem = FindOperation(machine, "axis1", "zeros").error().text;
  EXPECT_THAT(problem, HasSubstr("did you mean zero?"));
  EXPECT_THAT(problem, HasSubstr("operations: zero, read, "));
}

TEST(FindOperation, PointsToHomeWhereTheDeviceKeepsNoZero) {
  static const Family plain{.name = "plain", .summary = "", .operations = {}};
  for (const char* zero : {"zero", "zero_single_turn"}) {
    EXPECT_THAT(FindOperation(OneAxis(&plain), "axis1", zero).error().text,
                HasSubstr("axlecast home axis1 --value 0"));
  }
}

TEST(FindOperation, TellsWhichDevicesHaveTheOperationOfAnotherKind) {
  const MachineConfig machine = Machine();
  EXPECT_EQ(
      FindOperation(machine, "axis1", "fetch_trip_logs").error().text,
      "axis1 has no operation 'fetch_trip_logs': it is an encoder (made_up); no device of this machine has it");
  MachineConfig both = Machine();
  both.buses.push_back(both.buses[0]);
  both.buses[1].family = FindFamily("tsubaki_sc");
  both.buses[1].devices[0].name = "gm3";
  EXPECT_THAT(FindOperation(both, "axis1", "fetch_trip_logs").error().text,
              HasSubstr("devices of this machine that have it: gm3"));
  EXPECT_THAT(FindOperation(both, "gm3", "zero").error().text, HasSubstr("it is a monitor of motors (tsubaki_sc)"));
}

TEST(SetArguments, KeepsOrderAndEmptyValues) {
  CommandRequest request;
  EXPECT_TRUE(SetArguments(Operations()[1], {"count=", "address=3=4"}, request).has_value());
  EXPECT_THAT(request.arguments, ElementsAre(Pair("count", ""), Pair("address", "3=4")));
}

TEST(SetArguments, RefusesWhatTheOperationDoesNotTake) {
  CommandRequest request;
  EXPECT_EQ(SetArguments(Operations()[1], {"addres=3"}, request).error().text,
            "unknown argument addres: read takes address, count (optional)");
  EXPECT_EQ(SetArguments(Operations()[1], {"address"}, request).error().text, "'address' is no key=value");
  EXPECT_EQ(SetArguments(Operations()[1], {"=3"}, request).error().text, "'=3' is no key=value");
  EXPECT_EQ(SetArguments(Operations()[0], {"a=3"}, request).error().text,
            "unknown argument a: zero takes no argument");
  EXPECT_EQ(SetArguments(Operations()[1], {}, request).error().text,
            "argument address is missing: read takes address, count (optional)");
  EXPECT_EQ(SetArguments(Operations()[1], {"address=1", "address=2"}, request).error().text,
            "argument address is given twice: give it once");
}

TEST(OperationList, TellsHelpArgumentsAndCheck) {
  const MachineConfig machine = Machine();
  const std::string list = OperationList(machine.buses[0]);
  EXPECT_THAT(list, HasSubstr("zero  (destructive: asks first)\n    sets zero\n    verified by: a reading\n"));
  EXPECT_THAT(list, HasSubstr("    count=  1..80 (optional)\n"));
}

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
