#include "tools/axlecast/setup/config_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <CLI/CLI.hpp>
#include <fstream>
#include <string>

#include "core/config/load.h"
#include "tests/support/temporary_folder.h"
#include "tools/axlecast/common/subcommands.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
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
  EXPECT_NEAR(load.max_hz, 19'608, 1);
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
  EXPECT_THAT(text, HasSubstr("all channels but '^POSITION', kept for 14 days, about 3.63 kB/s\n"));
  EXPECT_THAT(text, HasSubstr("all channels, at most 20480 MB, about 195 kB/s: the quota lasts 31 hours\n"));
  const auto json = ConfigJson("m.yaml", &machine, ConfigErrors("m.yaml"));
  EXPECT_EQ(json["recorder"]["logs"][0]["keep_s"], 14.0 * 86'400);
}

TEST(ConfigWarnings, EachNamesCauseAndRemedy) {
  EXPECT_THAT(
      BusWarnings(Machine("simulate: true, poll_hz: 19000")),
      ElementsAre(HasSubstr("bus b0: readings take 97 % of the wire's time: commands and retries will replace "
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

// Public keys of RFC 8032, 7.1: TEST 1 to 3. Their ids by Python's hashlib.blake2b(key, digest_size=32).
constexpr const char* kKey =
    "key: {public: d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a, "
    "file: /etc/axlecast/bridge.key}";
constexpr const char* kDrivers =
    "drivers: {public: 3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c}";
constexpr const char* kKeys =
    "keys: {plc: {public: fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025, "
    "role: control, devices: [a], credential: plc}}";

MachineConfig MachineWithBridge(const std::string& bridge,
                                const std::string& url = "udpm://239.255.76.67:7668?ttl=0") {
  ConfigErrors errors("m.yaml");
  const auto machine =
      ParseConfig("machine: press3\nlcm: {command_url: '" + url + "'}\nbridge: {" + bridge +
                      "}\nbuses:\n  b0: {family: tformat, devices: {a: {model: ts5669n127}}, simulate: true}\n",
                  errors);
  EXPECT_EQ(errors.Text(), "");
  return machine.value_or(MachineConfig{});
}

std::string All() { return std::string(kKey) + ", " + kDrivers + ", " + kKeys; }

TEST(KeyWarnings, AMachineWithItsThreeKindsOfKeysHasNone) {
  EXPECT_THAT(KeyWarnings(MachineWithBridge(All())), IsEmpty());
}

TEST(KeyWarnings, NobodyCanCommandOrEverybodyCan) {
  EXPECT_THAT(
      KeyWarnings(MachineWithBridge("")),
      ElementsAre(HasSubstr("nobody can command this machine: bridge.keys contains no key, and unsigned "
                            "commands are refused; axlecast keygen --machine press3 makes the first keys")));
  EXPECT_THAT(KeyWarnings(MachineWithBridge("unsigned_commands: allow")),
              ElementsAre(HasSubstr("every program on this host may command this machine")));
  EXPECT_THAT(
      KeyWarnings(MachineWithBridge("unsigned_commands: allow, " + All(), "udpm://239.255.76.67:7668?ttl=1")),
      ElementsAre(HasSubstr("anybody on the network may command this machine; set ttl=0, or refuse them")));
}

TEST(KeyWarnings, AKeyThatIsMissing) {
  EXPECT_THAT(KeyWarnings(MachineWithBridge(kKeys)),
              ElementsAre(HasSubstr("bridge.key is missing: the drivers execute nothing")));
  EXPECT_THAT(KeyWarnings(MachineWithBridge(std::string(kKey) + ", " + kKeys)),
              ElementsAre(HasSubstr(
                  "bridge.drivers is missing: the bridge accepts every message that claims to be from a driver")));
}

TEST(KeysText, NamesEveryKeyByItsId) {
  EXPECT_EQ(
      KeysText(MachineWithBridge(All() + ", journal: /var/lib/j.db")),
      "bridge\n"
      "    unsigned   refused\n"
      "    journal    /var/lib/j.db\n"
      "    bridge     7849ac3049680be1  secret in /etc/axlecast/bridge.key\n"
      "    drivers    6ec9e955a19ba3c9  secret not on this host\n"
      "    key plc                      a64ff33916326928  control    devices a; operations all of the role; secret "
      "in credential plc\n");
  EXPECT_THAT(KeysText(MachineWithBridge("")), AllOf(HasSubstr("bridge     no key: nothing is obeyed"),
                                                     HasSubstr("drivers    no key: anybody is believed")));
}

TEST(KeysJson, HoldsTheSame) {
  const auto json = KeysJson(MachineWithBridge(All()));
  EXPECT_EQ(json["unsigned_commands"], "refuse");
  EXPECT_EQ(json["key"]["key_id"], "7849ac3049680be1");
  EXPECT_EQ(json["key"]["file"], "/etc/axlecast/bridge.key");
  EXPECT_EQ(json["drivers"]["file"], nullptr);
  EXPECT_EQ(json["keys"][0]["name"], "plc");
  EXPECT_EQ(json["keys"][0]["role"], "control");
  EXPECT_EQ(json["keys"][0]["devices"], nlohmann::ordered_json::array({"a"}));
  EXPECT_EQ(json["keys"][0]["credential"], "plc");
  EXPECT_EQ(KeysJson(MachineWithBridge(""))["key"], nullptr);
}

}  // namespace

}  // namespace axlecast
