#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/command/keys.h"
#include "core/config/load.h"

namespace axlecast {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Public keys of RFC 8032, 7.1: TEST 1, 2, 3, 1024.
#define KEY1 "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a"
#define KEY2 "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c"
#define KEY3 "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025"
#define KEY4 "278117fc144c72340f67d0f2316e8386ceffbf2b2428c9c51fef7c597f1d426e"

constexpr const char* kBuses =
    "buses:\n"
    "  b0: {family: point, simulate: true, devices: {axis1: {}}}\n"
    "  b1: {family: ring, simulate: true, poll_hz: 10, devices: {ring1: {}, ring2: {}}}\n";

// The bridge's keys begin in line 3.
std::string Machine(const std::string& bridge) { return "machine: press3\nbridge:\n" + bridge + "\n" + kBuses; }

BridgeConfig Bridge(const std::string& keys) {
  ConfigErrors errors("m.yaml");
  const auto machine = ParseConfig(Machine(keys), errors);
  EXPECT_EQ(errors.Text(), "");
  return machine ? machine->bridge : BridgeConfig{};
}

TEST(LoadBridge, ReadsEveryKey) {
  const BridgeConfig bridge = Bridge(
      "  unsigned_commands: refuse\n"
      "  journal: /var/lib/axlecast/press3/journal.db\n"
      "  key: {public: " KEY1
      ", file: /etc/axlecast/press3/bridge.key}\n"
      "  drivers: {public: " KEY2
      ", credential: press3-drivers}\n"
      "  keys:\n"
      "    local: {public: " KEY3
      ", role: maintainer, file: /etc/axlecast/press3/local.key}\n"
      "    plc: {public: " KEY4 ", role: control, devices: [axis1], operations: [zero, set_datum]}");
  EXPECT_FALSE(bridge.allow_unsigned);
  EXPECT_EQ(bridge.journal, "/var/lib/axlecast/press3/journal.db");
  EXPECT_EQ(bridge.bridge.public_key, ParsePublicKey(KEY1));
  EXPECT_EQ(bridge.bridge.place.file, "/etc/axlecast/press3/bridge.key");
  EXPECT_TRUE(bridge.bridge.place.group_may_read);
  EXPECT_EQ(bridge.drivers.public_key, ParsePublicKey(KEY2));
  EXPECT_EQ(bridge.drivers.place.credential, "press3-drivers");
  ASSERT_EQ(bridge.keys.size(), 2U);
  const KeyGrant& local = bridge.keys[0];
  EXPECT_EQ(local.name, "local");
  EXPECT_EQ(local.key, ParsePublicKey(KEY3));
  EXPECT_EQ(local.id, KeyId(local.key));
  EXPECT_EQ(local.role, Role::kMaintainer);
  EXPECT_THAT(local.devices, IsEmpty());
  EXPECT_THAT(local.operations, IsEmpty());
  EXPECT_EQ(local.place.file, "/etc/axlecast/press3/local.key");
  const KeyGrant& plc = bridge.keys[1];
  EXPECT_EQ(plc.role, Role::kControl);
  EXPECT_THAT(plc.devices, ElementsAre("axis1"));
  EXPECT_THAT(plc.operations, ElementsAre("zero", "set_datum"));
  EXPECT_TRUE(plc.place.empty());
  EXPECT_EQ(bridge.FindKey(plc.id), &plc);
  EXPECT_EQ(bridge.FindKey(1), nullptr);
}

TEST(LoadBridge, WhatIsLeftOutIsRefusedOrAbsent) {
  const BridgeConfig bridge = Bridge("  journal: /j.db");
  EXPECT_FALSE(bridge.allow_unsigned);
  EXPECT_FALSE(bridge.bridge.public_key);
  EXPECT_FALSE(bridge.drivers.public_key);
  EXPECT_THAT(bridge.keys, IsEmpty());
  EXPECT_TRUE(Bridge("  unsigned_commands: allow").allow_unsigned);
}

TEST(LoadBridge, EachRole) {
  for (const auto& [name, role] : {std::pair{"observer", Role::kObserver},
                                   {"operator", Role::kOperator},
                                   {"control", Role::kControl},
                                   {"maintainer", Role::kMaintainer}}) {
    const BridgeConfig bridge = Bridge("  keys: {a: {public: " KEY1 ", role: " + std::string(name) + "}}");
    ASSERT_EQ(bridge.keys.size(), 1U);
    EXPECT_EQ(bridge.keys[0].role, role);
  }
}

// A driver knows no other families: what it cannot judge, others do.
TEST(LoadBridge, OperationsOfFamiliesThatAreNotKnownHerePass) {
  const std::string text =
      "machine: a\n"
      "bridge: {keys: {a: {public: " KEY1
      ", role: maintainer, devices: [axis1, other], operations: [wash]}}}\n"
      "buses:\n"
      "  b0: {family: point, simulate: true, devices: {axis1: {}}}\n"
      "  b1: {family: of_another_driver, devices: {other: {}}}\n";
  ConfigErrors errors("m.yaml");
  const auto machine = ParseConfig(text, errors, "b0");
  EXPECT_EQ(errors.Text(), "");
  ASSERT_TRUE(machine);
  EXPECT_THAT(machine->bridge.keys.at(0).devices, ElementsAre("axis1", "other"));
}

struct Mistake {
  const char* keys;
  const char* message;
};
class BridgeMistakeTest : public ::testing::TestWithParam<Mistake> {};

TEST_P(BridgeMistakeTest, NamesPlaceValueAndWhatIsRight) {
  ConfigErrors errors("m.yaml");
  EXPECT_FALSE(ParseConfig(Machine(GetParam().keys), errors));
  EXPECT_EQ(errors.Text(), std::string(GetParam().message) + '\n');
}

INSTANTIATE_TEST_SUITE_P(
    OwnKeys, BridgeMistakeTest,
    ::testing::Values(
        Mistake{"  journal: journal.db",
                "m.yaml:3:12: bridge.journal: 'journal.db' is no absolute path, e.g. /var/lib/axlecast/journal.db"},
        Mistake{"  jounal: /a", "m.yaml:3:3: bridge: unknown key 'jounal'; did you mean 'journal'?"},
        Mistake{"  key: {file: /a.key}", "m.yaml:3:8: bridge.key.public: is missing"},
        Mistake{"  key: {public: 1234}",
                "m.yaml:3:17: bridge.key.public: '1234' is no public key: 64 hex digits, as axlecast keygen prints "
                "them"},
        Mistake{
            "  key: {public: 0000000000000000000000000000000000000000000000000000000000000000}",
            "m.yaml:3:17: bridge.key.public: '0000000000000000000000000000000000000000...' is no public key: 64 "
            "hex digits, as axlecast keygen prints them"},
        Mistake{"  key: {public: " KEY1 ", file: bridge.key}",
                "m.yaml:3:89: bridge.key.file: 'bridge.key' is no absolute path, e.g. /etc/axlecast/bridge.key"},
        Mistake{"  key: {public: " KEY1 ", file: /a.key, credential: a}",
                "m.yaml:3:109: bridge.key.credential: is given together with file: it is read from one of them; "
                "leave the "
                "other out"},
        Mistake{"  key: {public: " KEY1 ", credential: a/b}",
                "m.yaml:3:95: bridge.key.credential: 'a/b' is no name below $CREDENTIALS_DIRECTORY, without '/'"},
        Mistake{"  drivers: {public: " KEY1 "}",
                "m.yaml:3:12: bridge.drivers: needs key beside it: drivers that sign obey a bridge that signs"},
        Mistake{
            "  key: {public: " KEY1 "}\n  drivers: {public: " KEY1 "}",
            "m.yaml:4:21: bridge.drivers.public: is the key of bridge.key already: each has a key of its own"}));

INSTANTIATE_TEST_SUITE_P(
    Grants, BridgeMistakeTest,
    ::testing::Values(
        Mistake{"  keys: {A: {public: " KEY1 ", role: observer}}",
                "m.yaml:3:10: bridge.keys.A: 'A' is no name: 1 to 24 of a-z, 0-9, _ and -"},
        Mistake{"  keys: {unsigned: {public: " KEY1 ", role: observer}}",
                "m.yaml:3:10: bridge.keys.unsigned: is what the journal calls senders without a key: another name"},
        Mistake{"  keys: {a: {role: observer}}", "m.yaml:3:10: bridge.keys.a.public: is missing"},
        Mistake{"  keys: {a: {public: " KEY1 "}}",
                "m.yaml:3:10: bridge.keys.a.role: is missing: one of observer, operator, control, maintainer"},
        Mistake{
            "  keys: {a: {public: " KEY1 ", role: maintaner}}",
            "m.yaml:3:94: bridge.keys.a.role: 'maintaner' is not one of observer, operator, control, maintainer; "
            "did you mean 'maintainer'?"},
        Mistake{"  keys:\n    a: {public: " KEY1 ", role: observer}\n    a: {public: " KEY2 ", role: observer}",
                "m.yaml:5:5: key 'a' is given twice here; the first is in line 4"},
        Mistake{
            "  keys:\n    a: {public: " KEY1 ", role: observer}\n    b: {public: " KEY1 ", role: observer}",
            "m.yaml:5:17: bridge.keys.b.public: is the key of bridge.keys.a already: each has a key of its own"},
        Mistake{"  key: {public: " KEY1 "}\n  keys: {a: {public: " KEY1 ", role: observer}}",
                "m.yaml:4:22: bridge.keys.a.public: is the key of bridge.key already: each has a key of its own"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: control, devices: [axs1]}}",
                "m.yaml:3:112: bridge.keys.a.devices: 'axs1' is no device of this machine; did you mean 'axis1'?"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: control, devices: [gm]}}",
                "m.yaml:3:112: bridge.keys.a.devices: 'gm' is no device of this machine; known here: axis1, ring1, "
                "ring2"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: control, devices: []}}",
                "m.yaml:3:112: bridge.keys.a.devices: is empty: name at least one, or leave the key out"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: control, devices: axis1}}",
                "m.yaml:3:112: bridge.keys.a.devices: 'axis1' is given where a list is expected: [a, b]"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: control, devices: [axis1, axis1]}}",
                "m.yaml:3:120: bridge.keys.a.devices: 'axis1' is given twice"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: control, devices: [[axis1]]}}",
                "m.yaml:3:113: bridge.keys.a.devices: '' is not a text"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: control, operations: [zeor]}}",
                "m.yaml:3:115: bridge.keys.a.operations: no device of this grant has an operation 'zeor'; did you "
                "mean 'zero'?"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: control, devices: [ring1], operations: [zero]}}",
                "m.yaml:3:133: bridge.keys.a.operations: no device of this grant has an operation 'zero'; known "
                "here: accept_exchange, acknowledge_alarm, clear_datum, set_datum, shelve_alarm, undo_datum, "
                "unshelve_alarm"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: maintainer, operations: [hidden]}}",
                "m.yaml:3:118: bridge.keys.a.operations: no device of this grant has an operation 'hidden'; known "
                "here: accept_exchange, acknowledge_alarm, clear_datum, look, mark, set_datum, shelve_alarm, "
                "undo_datum, unshelve_alarm, zero"},
        Mistake{
            "  keys: {a: {public: " KEY1 ", role: operator, operations: [zero]}}",
            "m.yaml:3:116: bridge.keys.a.operations: 'zero' is not for role operator: leave it out, or give the "
            "key another role"},
        Mistake{
            "  keys: {a: {public: " KEY1 ", role: observer, operations: [mark]}}",
            "m.yaml:3:116: bridge.keys.a.operations: 'mark' is not for role observer: leave it out, or give the "
            "key another role"},
        Mistake{"  keys: {a: {public: " KEY1 ", role: observer, password: x}}",
                "m.yaml:3:104: bridge.keys.a: unknown key 'password'; known here: credential, devices, file, "
                "operations, public, role"}));

}  // namespace
}  // namespace axlecast
