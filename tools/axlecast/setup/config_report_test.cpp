#include "tools/axlecast/setup/config_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "core/config/load.h"
#include "tests/support/temporary_folder.h"
#include "tools/axlecast/setup/subcommands.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

MachineConfig Machine(const std::string& bus, const std::string& top = "") {
  ConfigErrors errors("m.yaml");
  const auto machine =
      ParseConfig("machine: press3\n" + top +
                      "buses:\n  b0: {family: tformat, devices: {a: {model: ts5669n127}}, " + bus + "}\n",
                  errors);
  EXPECT_EQ(errors.Text(), "");
  return machine.value_or(MachineConfig{});
}

// TS5669 spec: 4 us request, 3 us, 44 us reply of data ID 3: 51 us, 19.6 k readings/s.
TEST(LoadOf, FollowsFromTheWireTime) {
  const BusLoad load = LoadOf(Machine("simulate: true, poll_hz: 2000").buses.at(0));
  EXPECT_DOUBLE_EQ(load.round_us, 51);
  EXPECT_NEAR(load.most_hz, 19'608, 1);
  EXPECT_DOUBLE_EQ(load.poll_hz, 2000);
  EXPECT_NEAR(load.utilisation, 0.102, 1e-9);
  const BusLoad free = LoadOf(Machine("simulate: true, poll_hz: 0").buses.at(0));
  EXPECT_NEAR(free.poll_hz, 19'608, 1);
  EXPECT_DOUBLE_EQ(free.utilisation, 1);
}

// Of a machine whose commands are nobody's worry here (key_report_test.cpp).
std::vector<std::string> BusWarnings(const MachineConfig& machine) {
  std::vector<std::string> warnings = ConfigWarnings(machine);
  EXPECT_THAT(warnings.back(), HasSubstr("nobody can command this machine"));
  warnings.pop_back();
  return warnings;
}

TEST(ConfigWarnings, AGoodMachineHasNone) {
  EXPECT_THAT(BusWarnings(Machine("simulate: true")), IsEmpty());
  EXPECT_THAT(BusWarnings(Machine("link: {port: /dev/serial/by-id/usb-x}")), IsEmpty());
  EXPECT_THAT(BusWarnings(Machine("simulate: true, poll_hz: 0")), IsEmpty()) << "as fast as possible is meant";
}

TEST(ConfigText, PointsOutAnAxisThatHasOnlyTheModelsLimits) {
  const MachineConfig only = Machine("simulate: true");
  EXPECT_THAT(ConfigText(only), HasSubstr("limits of the model only: `axlecast hwtest a` proposes its own"));
  ConfigErrors errors("m.yaml");
  const auto own = ParseConfig(
      "machine: press3\nbuses:\n  b0: {family: tformat, simulate: true, devices: {a: {model: ts5669n127, "
      "limits: {speed_rpm: 3000, accel_rad_s2: 1000}}}}\n",
      errors);
  ASSERT_TRUE(own) << errors.Text();
  EXPECT_THAT(ConfigText(*own), HasSubstr("at most 3000 rpm and 1000 rad/s2"));
  EXPECT_EQ(ConfigJson("m.yaml", &only, errors)["buses"][0]["devices"][0]["own_limits"], false);
  EXPECT_EQ(ConfigJson("m.yaml", &*own, errors)["buses"][0]["devices"][0]["own_limits"], true);
}

TEST(ConfigText, NamesTheRecordersLogs) {
  const MachineConfig machine = Machine("simulate: true",
                                        "recorder:\n"
                                        "  directory: /data\n"
                                        "  logs:\n"
                                        "    events: {channels: ^POSITION, invert: true, keep: 2w}\n"
                                        "    all: {quota: 20GB}\n");
  const std::string text = ConfigText(machine);
  EXPECT_THAT(text, HasSubstr("recorder, into /data\n"));
  EXPECT_THAT(text, HasSubstr("all channels but '^POSITION', kept for 14 days\n"));
  EXPECT_THAT(text, HasSubstr("all channels, at most 20480 MB\n"));
  const auto json = ConfigJson("m.yaml", &machine, ConfigErrors("m.yaml"));
  EXPECT_EQ(json["recorder"]["logs"][0]["keep_s"], 14.0 * 86'400);
}

TEST(ConfigWarnings, EachNamesCauseAndRemedy) {
  EXPECT_THAT(BusWarnings(Machine("simulate: true, poll_hz: 19000")),
              ElementsAre(HasSubstr("bus b0: readings take 97 % of the wire's time: commands and retries will cost "
                                    "readings; poll_hz 17647 or less")));
  EXPECT_THAT(BusWarnings(Machine("link: {port: /dev/serial/by-id/usb-x}, poll_hz: 2000")),
              ElementsAre(HasSubstr("a USB adapter answers at most about 1000 times a second")));
  EXPECT_THAT(BusWarnings(Machine("link: {port: /dev/ttyUSB0}")),
              ElementsAre(HasSubstr("/dev/ttyUSB0 may name another adapter after the next start")));
}

TEST(ConfigText, NamesEveryBusAndDevice) {
  const std::string text = ConfigText(Machine("link: {port: /dev/ttyS4}, poll_hz: 500"));
  EXPECT_THAT(text, HasSubstr("/dev/ttyS4, 2500000 baud"));
  EXPECT_THAT(text,
              HasSubstr("polled at 500 Hz, one round takes 51 us: 2.5 % of the wire's time, at most 19608 Hz"));
  EXPECT_THAT(text, HasSubstr("refreshed every 2000 us, published at 500 Hz, 1 turn/turn"));
  EXPECT_THAT(text, HasSubstr("500 POSITION and MOTOR messages a second at most"));
  EXPECT_THAT(text, HasSubstr("bridge\n    unsigned   refused\n"));
}

TEST(ConfigJson, HoldsTheSameOrTheErrors) {
  const MachineConfig machine = Machine("simulate: true, poll_hz: 500");
  const auto json = ConfigJson("m.yaml", &machine, ConfigErrors("m.yaml"));
  EXPECT_EQ(json["ok"], true);
  EXPECT_EQ(json["machine"], "press3");
  EXPECT_EQ(json["buses"][0]["round_us"], 51.0);
  EXPECT_EQ(json["buses"][0]["devices"][0]["refresh_us"], 2000.0);
  EXPECT_EQ(json["buses"][0]["devices"][0]["unit"], "turn");
  EXPECT_EQ(json["bridge"]["unsigned_commands"], "refuse");

  ConfigErrors errors("m.yaml");
  EXPECT_FALSE(ParseConfig("machine: a\n", errors));
  const auto bad = ConfigJson("m.yaml", nullptr, errors);
  EXPECT_EQ(bad["ok"], false);
  EXPECT_EQ(bad["machine"], nullptr);
  EXPECT_EQ(bad["errors"][0]["line"], 1);
  EXPECT_EQ(bad["errors"][0]["text"], "buses: is missing or empty: a machine needs at least one bus");
}

class CheckConfigTest : public ::testing::Test {
 protected:
  int Check(const std::string& text) {
    const std::string file = directory_ + "/m.yaml";
    std::ofstream(file) << text;
    CLI::App app("test", "axlecast");
    int exit_code = -1;
    AddCheckConfigCommand(app, exit_code);
    app.parse("check-config " + file);
    return exit_code;
  }

  const TemporaryFolder folder_;
  const std::string directory_ = folder_.path();
};

TEST_F(CheckConfigTest, EndsWithOneOnAnyErrorAlsoOfTheSimulator) {
  const std::string file =
      "machine: a\nbuses:\n  b0: {family: tformat, devices: {a: {model: ts5669n127}}, simulate: ";
  EXPECT_EQ(Check(file + "true}\n"), 0);
  EXPECT_EQ(Check(file + "{a: {speed_rpm: 60}}}\n"), 0);
  EXPECT_EQ(Check(file + "{a: {speed_rpm: fast}}}\n"), 1);
  EXPECT_EQ(Check(file + "{b: {speed_rpm: 60}}}\n"), 1);
  EXPECT_EQ(Check("machine: a\n"), 1);
}

}  // namespace
}  // namespace axlecast
