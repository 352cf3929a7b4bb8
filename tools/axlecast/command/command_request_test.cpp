#include <gmock/gmock.h>

#include "tools/axlecast/command/command_request.h"
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
            "read takes no 'addres'; arguments: address, count");
  EXPECT_EQ(SetArguments(Operations()[1], {"address"}, request).error().text, "'address' is no key=value");
  EXPECT_EQ(SetArguments(Operations()[1], {"=3"}, request).error().text, "'=3' is no key=value");
  EXPECT_EQ(SetArguments(Operations()[0], {"a=3"}, request).error().text,
            "zero takes no 'a'; it takes no arguments");
  EXPECT_EQ(SetArguments(Operations()[1], {}, request).error().text, "read needs address=... (0..79)");
  EXPECT_EQ(SetArguments(Operations()[1], {"address=1", "address=2"}, request).error().text,
            "'address' is given twice");
}

TEST(OperationList, TellsHelpArgumentsAndCheck) {
  const MachineConfig machine = Machine();
  const std::string list = OperationList(machine.buses[0]);
  EXPECT_THAT(list, HasSubstr("zero  (destructive: asks first)\n    sets zero\n    verified by: a reading\n"));
  EXPECT_THAT(list, HasSubstr("    count=  1..80 (optional)\n"));
}

}  // namespace

}  // namespace axlecast
