#include "tools/doctor/check.h"

#include <gmock/gmock.h>

#include <cerrno>

#include "tools/doctor/test_host.h"

namespace axlecast {
namespace {

using testing::IsEmpty;

constexpr const char* kOwn = "/etc/axlecast/bridge.key";
constexpr const char* kLocal = "/etc/axlecast/local.key";

MachineConfig Signed() {
  // RFC 8032 7.1, tests 1 and 2.
  const std::string one = "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a";
  const std::string two = "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c";
  return OneAxis("", "bridge: {key: {public: " + one + ", file: " + kOwn + "}, keys: {local: {public: " + two +
                         ", role: maintainer, file: " + kLocal + "}}}");
}

HostFile KeyFile(const char* path, mode_t mode, uid_t owner = 0, gid_t group = 0) {
  return {.path = path,
          .kind = HostFile::Kind::kRegular,
          .mode = mode,
          .uid = owner,
          .gid = group,
          .owner = "somebody",
          .group = "axlecast",
          .readable = false};
}

HostFacts WithKeys(const HostFile& own, const HostFile& local) {
  HostFacts host = GoodHost();
  host.secrets.emplace(kOwn, own);
  host.secrets.emplace(kLocal, local);
  return host;
}

struct ModeCase {
  mode_t mode;
  gid_t group;
  const char* line;  // null: nothing is found
};

TEST(KeyChecks, ModesAreThoseThatTheReaderTakes) {
  const ModeCase cases[] = {
      {0600, 0, nullptr},      {0400, 0, nullptr},      {0640, 0, nullptr},      {0440, 7, nullptr},
      {0660, 7, "chmod 640 "}, {0644, 7, "chmod 640 "}, {0644, 0, "chmod 600 "}, {0604, 7, "chmod 600 "},
      {0620, 7, "chmod 600 "}, {0601, 0, "chmod 600 "}, {0777, 7, "chmod 640 "},
  };
  for (const ModeCase& one : cases) {
    const HostFacts host = WithKeys(KeyFile(kOwn, one.mode, 0, one.group), KeyFile(kLocal, 0600));
    const Symptoms symptoms = RunCheck("key_mode", Signed(), host);
    ASSERT_EQ(symptoms.size(), one.line == nullptr ? 0U : 1U) << std::oct << one.mode;
    if (one.line == nullptr) continue;
    EXPECT_EQ(LineOf(symptoms[0].fixes[0]), one.line + std::string(kOwn));
  }
}

TEST(KeyChecks, TheMachinesOwnKeysAreNoPersons) {
  for (const uid_t owner : {0U, 999U, 1000U}) {  // 1000 runs this
    EXPECT_THAT(RunCheck("key_owner", Signed(), WithKeys(KeyFile(kOwn, 0600, owner), KeyFile(kLocal, 0600))),
                IsEmpty());
  }
  EXPECT_EQ(RunCheck("key_owner", Signed(), WithKeys(KeyFile(kOwn, 0600, 1001), KeyFile(kLocal, 0600))).size(), 1U);
  EXPECT_THAT(RunCheck("key_owner", Signed(), WithKeys(KeyFile(kOwn, 0600), KeyFile(kLocal, 0600, 1001))),
              IsEmpty())
      << "a key that commands may be a person's";
}

TEST(KeyChecks, AMissingFileIsToldAndOneThatCannotBeSeenIsNot) {
  HostFile missing = KeyFile(kOwn, 0600);
  missing.error = ENOENT;
  EXPECT_EQ(RunCheck("key_missing", Signed(), WithKeys(missing, KeyFile(kLocal, 0600))).size(), 1U);
  missing.error = EACCES;
  EXPECT_THAT(RunCheck("key_missing", Signed(), WithKeys(missing, KeyFile(kLocal, 0600))), IsEmpty());
}

TEST(KeyChecks, AUserNeedsOneKeyThatMayCommand) {
  HostFacts host = WithKeys(KeyFile(kOwn, 0600), KeyFile(kLocal, 0640, 0, 7));
  EXPECT_EQ(RunCheck("key_permission", Signed(), host).size(), 1U);
  host.secrets.at(kLocal).readable = true;
  EXPECT_THAT(RunCheck("key_permission", Signed(), host), IsEmpty());
  host.secrets.at(kLocal) = KeyFile(kLocal, 0600, 1001);
  EXPECT_THAT(RunCheck("key_permission", Signed(), host), IsEmpty()) << "another person's key is that person's";
}

TEST(KeyChecks, TheFileIsNotEverybodysToWrite) {
  HostFacts host = GoodHost();
  host.configs = {{.file = KeyFile("m.yaml", 0664)}};
  EXPECT_THAT(RunCheck("config_mode", OneAxis(), host), IsEmpty());
  host.configs[0].shared = true;  // with a group that is more than its owner
  EXPECT_EQ(RunCheck("config_mode", OneAxis(), host).size(), 1U);
  host.configs[0].file.mode = 0666;
  EXPECT_EQ(LineOf(RunCheck("config_mode", OneAxis(), host).at(0).fixes.at(0)), "chmod go-w m.yaml");
  host.configs = {{.file = KeyFile("m.yaml", 0644)}, {.file = KeyFile("axes.yaml", 0666)}};
  const Symptoms included = RunCheck("config_mode", OneAxis(), host);
  ASSERT_EQ(included.size(), 1U);
  EXPECT_EQ(included[0].found, "the included file axes.yaml has mode 0666");
}

constexpr const char* kBridgeKey = "/etc/axlecast/press3/bridge.key";
constexpr const char* kDriversKey = "/etc/axlecast/press3/drivers.key";
constexpr const char* kLocalKey = "/etc/axlecast/press3/local.key";

MachineConfig InstalledMachine() {
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
  EXPECT_THAT(RunCheck("key_access", InstalledMachine(), host), IsEmpty());
  host.secrets[kLocalKey] = File(kLocalKey, 0600, "root");
  host.secrets[kBridgeKey] = File(kBridgeKey, 0600, "root", "axlecast-bridge", 900);
  EXPECT_THAT(RunCheck("key_access", InstalledMachine(), host), IsEmpty());
}

// As docs/keys.md had it before: one group for all.
TEST(KeyAccess, AKeyOfAProcessIsForItsAccountOnly) {
  HostFacts host = AsInstalled();
  host.secrets[kBridgeKey] = File(kBridgeKey, 0640, "axlecast");
  host.secrets[kDriversKey] = File(kDriversKey, 0640, "axlecast-bridge");
  const Symptoms symptoms = RunCheck("key_access", InstalledMachine(), host);
  ASSERT_EQ(symptoms.size(), 2U);
  EXPECT_EQ(symptoms[0].found, std::string("the key ") + kBridgeKey +
                                   " can be read by the group axlecast, not only by axlecast-bridge");
  EXPECT_EQ(LineOf(symptoms[0].fixes[0]), std::string("chgrp axlecast-bridge ") + kBridgeKey);
  EXPECT_EQ(LineOf(symptoms[1].fixes[0]), std::string("chgrp axlecast-drivers ") + kDriversKey);
}

TEST(KeyAccess, AKeyThatItsProcessCannotReadIsFound) {
  HostFacts host = AsInstalled();
  host.secrets[kBridgeKey] = File(kBridgeKey, 0600, "root");
  EXPECT_EQ(RunCheck("key_access", InstalledMachine(), host).size(), 1U);
}

TEST(KeyAccess, NoProcessReadsAKeyThatCommands) {
  HostFacts host = AsInstalled();
  host.secrets[kLocalKey] = File(kLocalKey, 0640, "axlecast-web");
  EXPECT_EQ(LineOf(RunCheck("key_access", InstalledMachine(), host).at(0).fixes.at(0)),
            std::string("chown root:root ") + kLocalKey);
  host.secrets[kLocalKey] = File(kLocalKey, 0600, "root", "axlecast-bridge", 900);
  EXPECT_EQ(RunCheck("key_access", InstalledMachine(), host).size(), 1U);
}

TEST(KeyAccess, ADeskHasNoAccounts) {
  HostFacts host = AsInstalled();
  host.groups.clear();
  host.secrets[kBridgeKey] = File(kBridgeKey, 0640, "axlecast");
  EXPECT_THAT(RunCheck("key_access", InstalledMachine(), host), IsEmpty());
  host = AsInstalled();
  host.secrets[kBridgeKey] = File(kBridgeKey, 0600, "anna", "anna", 1000);
  EXPECT_THAT(RunCheck("key_access", InstalledMachine(), host), IsEmpty())
      << "a person's own machine beside the package";
}

TEST(GroupMembers, AsInstalledAllIsWell) {
  EXPECT_THAT(RunCheck("group_members", InstalledMachine(), AsInstalled()), IsEmpty());
}

TEST(GroupMembers, NobodyJoinsAProcess) {
  HostFacts host = AsInstalled();
  host.groups["axlecast-drivers"] = {"anna"};
  EXPECT_EQ(LineOf(RunCheck("group_members", InstalledMachine(), host).at(0).fixes.at(0)),
            "gpasswd --delete anna axlecast-drivers");
}

TEST(GroupMembers, OperatorsArePersonsWithoutDevices) {
  HostFacts host = AsInstalled();
  host.groups["axlecast"] = {"axlecast-web"};
  EXPECT_EQ(RunCheck("group_members", InstalledMachine(), host).size(), 1U);
  host.groups["axlecast"] = {"anna", "bob"};
  const Symptoms symptoms = RunCheck("group_members", InstalledMachine(), host);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_EQ(symptoms[0].found,
            "bob is in the group dialout, and may send commands: devices can be accessed without any interlock");
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
  EXPECT_THAT(RunCheck("group_members", OnSpi(), host), IsEmpty());
  node.group = "spi";
  Symptoms symptoms = RunCheck("group_members", OnSpi(), host);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_EQ(symptoms[0].found,
            "/dev/spidev0.0 can be opened by the group spi: devices can be accessed without any interlock");
  node.mode = 0666;
  symptoms = RunCheck("group_members", OnSpi(), host);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_EQ(LineOf(symptoms[0].fixes.at(0)), "chmod o= /dev/spidev0.0");
  host.ports["/dev/ttyUSB0"].file = File("/dev/ttyUSB0", 0666, "dialout");
  EXPECT_EQ(RunCheck("group_members", InstalledMachine(), host).size(), 1U) << "a serial port too";
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
