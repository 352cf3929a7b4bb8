#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/load.h"
#include "tools/axlecast/common/config_option.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;

const std::vector<ConfigKey> kKeys = {
    {.place = "machine", .kind = "text", .required = true},
    {.place = "buses.<name>.poll_hz", .kind = "number", .range = "0 to 20000 Hz", .fallback = "1000"},
    {.place = "buses.<name>.link", .kind = "mapping"},
    {.place = "buses.<name>.seen"},
};

TEST(ConfigKeys, TextIsALineEach) {
  EXPECT_EQ(ConfigKeysText(kKeys),
            "machine               text                  required\n"
            "buses.<name>.poll_hz  number                default 1000; 0 to 20000 Hz\n"
            "buses.<name>.link     mapping\n"
            "buses.<name>.seen     text\n");
}

TEST(ConfigKeys, JsonSaysNullWhereNothingIs) {
  const auto json = ConfigKeysJson(kKeys);
  ASSERT_EQ(json.size(), 4U);
  EXPECT_EQ(json[0].dump(), R"({"place":"machine","kind":"text","range":null,"default":null,"required":true})");
  EXPECT_EQ(json[1]["default"], "1000");
}

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

TEST(MachineUnits, ADatabaseNeedsTheShipper) {
  EXPECT_THAT(MachineUnits(Machine("recorder: {logs: {all: {}}}\nship: {database: host=db1}\n", "false")),
              ElementsAre("axlecast-bridge.service", "axlecast-record.service", "axlecast-ship.service",
                          "axlecast-driver@b-0.service", "axlecast-driver@b1.service"));
}

TEST(MachineNames, AreInTheFilesOrder) {
  EXPECT_THAT(MachineNames(Machine("", "false"), false), ElementsAre("b-0", "b1"));
  EXPECT_THAT(MachineNames(Machine("", "false"), true), ElementsAre("a", "b"));
}

}  // namespace

}  // namespace axlecast
