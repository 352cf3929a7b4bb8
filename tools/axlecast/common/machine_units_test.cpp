#include "tools/axlecast/common/machine_units.h"

#include <gmock/gmock.h>

#include "core/config/load.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;

MachineConfig Machine(const std::string& top, const std::string& simulate) {
  ConfigErrors errors("m.yaml");
  const auto machine =
      ParseConfig("machine: press3\n" + top +
                      "buses:\n"
                      "  b-0: {family: tformat, link: {port: /dev/ttyS0}, devices: {a: {model: ts5669n127}}}\n"
                      "  b1: {family: tformat, link: {port: /dev/ttyS1}, simulate: " +
                      simulate + ", devices: {b: {model: ts5669n127}}}\n",
                  errors);
  EXPECT_EQ(errors.Text(), "");
  return machine.value_or(MachineConfig{});
}

TEST(MachineUnits, AreTheBridgeAndADriverForEachBus) {
  EXPECT_THAT(MachineUnits(Machine("", "false")),
              ElementsAre("axlecast-bridge.service", "axlecast-driver@b-0.service", "axlecast-driver@b1.service"));
}

TEST(MachineUnits, RecorderAndSimulatorsStandWhereTheFileAsksForThem) {
  EXPECT_THAT(MachineUnits(Machine("recorder: {logs: {all: {}}}\n", "true")),
              ElementsAre("axlecast-bridge.service", "axlecast-record.service", "axlecast-simulate.service",
                          "axlecast-driver@b-0.service", "axlecast-driver@b1.service"));
}

TEST(MachineNames, AreInTheFilesOrder) {
  EXPECT_THAT(MachineNames(Machine("", "false"), false), ElementsAre("b-0", "b1"));
  EXPECT_THAT(MachineNames(Machine("", "false"), true), ElementsAre("a", "b"));
}

}  // namespace
}  // namespace axlecast
