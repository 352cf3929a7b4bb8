#include "tools/doctor/account_checks.h"

#include <gmock/gmock.h>

#include "tools/doctor/doctor_test_host.h"

namespace axlecast {
namespace {

using ::testing::IsEmpty;

constexpr const char* kBridgeKey = "/etc/axlecast/press3/bridge.key";
constexpr const char* kDriversKey = "/etc/axlecast/press3/drivers.key";
constexpr const char* kLocalKey = "/etc/axlecast/press3/local.key";

MachineConfig Signed() {
  // RFC 8032 7.1, tests 1 to 3.
  const std::string one = "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a";
  const std::string two = "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c";
  const std::string three = "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025";
  return OneAxis("", "bridge: {key: {public: " + one + ", file: " + kBridgeKey + "}, drivers: {public: " + two +
                         ", file: " + kDriversKey + "}, keys: {local: {public: " + three +
                         ", role: maintainer, file: " + kLocalKey + "}}}");
}

HostFile File(const char* path, mode_t mode, const std::string& group, const std::string& owner = "root",
              uid_t uid = 0) {
  return {.path = path, .kind = HostFile::Kind::kRegular, .mode = mode, .uid = uid, .owner = owner, .group = group};
}

HostFacts AsInstalled() {
  HostFacts host = GoodHost();
  for (const char* name : {"bridge", "drivers", "record", "web", "mqtt", "multicast"}) {
    host.groups[std::string("axlecast-") + name] = {};
  }
  host.groups["axlecast"] = {"anna"};
  host.groups["dialout"] = {"bob"};
  host.secrets[kBridgeKey] = File(kBridgeKey, 0640, "axlecast-bridge");
  host.secrets[kDriversKey] = File(kDriversKey, 0640, "axlecast-drivers");
  host.secrets[kLocalKey] = File(kLocalKey, 0640, "axlecast");
  return host;
}

TEST(KeyAccess, AsKeygenMakesThemAllIsWell) {
  HostFacts host = AsInstalled();
  EXPECT_THAT(CheckKeyAccess(Signed(), host), IsEmpty());
  host.secrets[kLocalKey] = File(kLocalKey, 0600, "root");
  host.secrets[kBridgeKey] = File(kBridgeKey, 0600, "root", "axlecast-bridge", 900);
  EXPECT_THAT(CheckKeyAccess(Signed(), host), IsEmpty());
}

// As docs/keys.md had it before: one group for all.
TEST(KeyAccess, AKeyOfAProcessIsForItsAccountOnly) {
  HostFacts host = AsInstalled();
  host.secrets[kBridgeKey] = File(kBridgeKey, 0640, "axlecast");
  host.secrets[kDriversKey] = File(kDriversKey, 0640, "axlecast-bridge");
  const Symptoms findings = CheckKeyAccess(Signed(), host);
  ASSERT_EQ(findings.size(), 2U);
  EXPECT_EQ(findings[0].found, std::string("the key ") + kBridgeKey +
                                   " can be read by the group axlecast, not by axlecast-bridge alone");
  EXPECT_EQ(LineOf(findings[0].fixes[0]), std::string("chgrp axlecast-bridge ") + kBridgeKey);
  EXPECT_EQ(LineOf(findings[1].fixes[0]), std::string("chgrp axlecast-drivers ") + kDriversKey);
}

TEST(KeyAccess, AKeyThatItsProcessCannotReadIsFound) {
  HostFacts host = AsInstalled();
  host.secrets[kBridgeKey] = File(kBridgeKey, 0600, "root");
  EXPECT_EQ(CheckKeyAccess(Signed(), host).size(), 1U);
}

TEST(KeyAccess, NoProcessReadsAKeyThatCommands) {
  HostFacts host = AsInstalled();
  host.secrets[kLocalKey] = File(kLocalKey, 0640, "axlecast-web");
  EXPECT_EQ(LineOf(CheckKeyAccess(Signed(), host).at(0).fixes.at(0)), std::string("chown root:root ") + kLocalKey);
  host.secrets[kLocalKey] = File(kLocalKey, 0600, "root", "axlecast-bridge", 900);
  EXPECT_EQ(CheckKeyAccess(Signed(), host).size(), 1U);
}

TEST(KeyAccess, ADeskHasNoAccounts) {
  HostFacts host = AsInstalled();
  host.groups.clear();
  host.secrets[kBridgeKey] = File(kBridgeKey, 0640, "axlecast");
  EXPECT_THAT(CheckKeyAccess(Signed(), host), IsEmpty());
  host = AsInstalled();
  host.secrets[kBridgeKey] = File(kBridgeKey, 0600, "anna", "anna", 1000);
  EXPECT_THAT(CheckKeyAccess(Signed(), host), IsEmpty()) << "a person's own machine beside the package";
}

TEST(GroupMembers, AsInstalledAllIsWell) { EXPECT_THAT(CheckGroupMembers(Signed(), AsInstalled()), IsEmpty()); }

TEST(GroupMembers, NobodyJoinsAProcess) {
  HostFacts host = AsInstalled();
  host.groups["axlecast-drivers"] = {"anna"};
  EXPECT_EQ(LineOf(CheckGroupMembers(Signed(), host).at(0).fixes.at(0)), "gpasswd --delete anna axlecast-drivers");
}

TEST(GroupMembers, OperatorsArePersonsWithoutDevices) {
  HostFacts host = AsInstalled();
  host.groups["axlecast"] = {"axlecast-web"};
  EXPECT_EQ(CheckGroupMembers(Signed(), host).size(), 1U);
  host.groups["axlecast"] = {"anna", "bob"};
  const Symptoms findings = CheckGroupMembers(Signed(), host);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].found,
            "bob is in the group dialout, and commands: devices can be reached past every interlock");
}

MachineConfig OnSpi() {
  return MachineOf(
      "buses: {s0: {family: ssi, link: {spidev: /dev/spidev0.0, clock_hz: 200000}, devices: {axis2: {model: saa, "
      "bits: 13, "
      "unit: deg}}}}");
}

TEST(GroupMembers, DeviceNodesAreTheDriversAlone) {
  HostFacts host = AsInstalled();
  HostFile& node = host.ports["/dev/spidev0.0"].file;
  node = File("/dev/spidev0.0", 0660, "axlecast-drivers");
  EXPECT_THAT(CheckGroupMembers(OnSpi(), host), IsEmpty());
  node.group = "spi";
  Symptoms findings = CheckGroupMembers(OnSpi(), host);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings[0].found,
            "/dev/spidev0.0 can be opened by the group spi: devices can be reached past every interlock");
  node.mode = 0666;
  findings = CheckGroupMembers(OnSpi(), host);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(LineOf(findings[0].fixes.at(0)), "chmod o= /dev/spidev0.0");
  host.ports["/dev/ttyUSB0"].file = File("/dev/ttyUSB0", 0666, "dialout");
  EXPECT_EQ(CheckGroupMembers(Signed(), host).size(), 1U) << "a serial port too";
}

TEST(RunsUnderAccounts, OnlyWithTheFileOfTheUnits) {
  MachineConfig machine = OneAxis();
  machine.file = "/etc/axlecast/machine.yaml";
  EXPECT_TRUE(RunsUnderAccounts(machine, AsInstalled()));
  EXPECT_FALSE(RunsUnderAccounts(machine, GoodHost()));
  machine.file = "/home/anna/machine.yaml";
  EXPECT_FALSE(RunsUnderAccounts(machine, AsInstalled()));
}

}  // namespace
}  // namespace axlecast
