#include "tools/axlecast/setup/key_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/load.h"

namespace axlecast {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Public keys of RFC 8032, 7.1: TEST 1 to 3. Their ids by Python's hashlib.blake2b(key, digest_size=32).
constexpr const char* kKey =
    "key: {public: d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a, "
    "file: /etc/axlecast/bridge.key}";
constexpr const char* kDrivers =
    "drivers: {public: 3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c}";
constexpr const char* kKeys =
    "keys: {plc: {public: fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025, "
    "role: control, devices: [a], credential: plc}}";

MachineConfig Machine(const std::string& bridge, const std::string& url = "udpm://239.255.76.67:7668?ttl=0") {
  ConfigErrors errors("m.yaml");
  const auto machine =
      ParseConfig("machine: press3\nlcm: {command_url: '" + url + "'}\nbridge: {" + bridge +
                      "}\nbuses:\n  b0: {family: tformat, devices: {a: {model: ts5669n127}}, simulate: true}\n",
                  errors);
  EXPECT_EQ(errors.Text(), "");
  return machine.value_or(MachineConfig{});
}

std::string All() { return std::string(kKey) + ", " + kDrivers + ", " + kKeys; }

TEST(KeyWarnings, AMachineWithItsThreeKindsOfKeysHasNone) { EXPECT_THAT(KeyWarnings(Machine(All())), IsEmpty()); }

TEST(KeyWarnings, NobodyCanCommandOrEverybodyCan) {
  EXPECT_THAT(
      KeyWarnings(Machine("")),
      ElementsAre(HasSubstr("nobody can command this machine: bridge.keys names no key, and unsigned "
                            "commands are refused; axlecast keygen --machine press3 makes the first keys")));
  EXPECT_THAT(KeyWarnings(Machine("unsigned_commands: allow")),
              ElementsAre(HasSubstr("every program on this host may command this machine")));
  EXPECT_THAT(KeyWarnings(Machine("unsigned_commands: allow, " + All(), "udpm://239.255.76.67:7668?ttl=1")),
              ElementsAre(HasSubstr("anybody on the network may command this machine; set ttl=0, or refuse them")));
}

TEST(KeyWarnings, AKeyThatIsMissing) {
  EXPECT_THAT(KeyWarnings(Machine(kKeys)),
              ElementsAre(HasSubstr("bridge.key is missing: the drivers obey nothing")));
  EXPECT_THAT(KeyWarnings(Machine(std::string(kKey) + ", " + kKeys)),
              ElementsAre(HasSubstr("bridge.drivers is missing: the bridge believes whoever says that he is a "
                                    "driver")));
}

TEST(KeysText, NamesEveryKeyByItsId) {
  EXPECT_EQ(
      KeysText(Machine(All() + ", journal: /var/lib/j.db")),
      "bridge\n"
      "    unsigned   refused\n"
      "    journal    /var/lib/j.db\n"
      "    bridge     7849ac3049680be1  secret in /etc/axlecast/bridge.key\n"
      "    drivers    6ec9e955a19ba3c9  secret not on this host\n"
      "    key plc                      a64ff33916326928  control    devices a; operations all of the role; secret "
      "in credential plc\n");
  EXPECT_THAT(KeysText(Machine("")), AllOf(HasSubstr("bridge     no key: nothing is obeyed"),
                                           HasSubstr("drivers    no key: anybody is believed")));
}

TEST(KeysJson, HoldsTheSame) {
  const auto json = KeysJson(Machine(All()));
  EXPECT_EQ(json["unsigned_commands"], "refuse");
  EXPECT_EQ(json["key"]["key_id"], "7849ac3049680be1");
  EXPECT_EQ(json["key"]["file"], "/etc/axlecast/bridge.key");
  EXPECT_EQ(json["drivers"]["file"], nullptr);
  EXPECT_EQ(json["keys"][0]["name"], "plc");
  EXPECT_EQ(json["keys"][0]["role"], "control");
  EXPECT_EQ(json["keys"][0]["devices"], nlohmann::ordered_json::array({"a"}));
  EXPECT_EQ(json["keys"][0]["credential"], "plc");
  EXPECT_EQ(KeysJson(Machine(""))["key"], nullptr);
}

}  // namespace
}  // namespace axlecast
