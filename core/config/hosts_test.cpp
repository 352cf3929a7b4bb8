#include "core/config/hosts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/load.h"
#include "core/config/test_family.h"

namespace axlecast {
namespace {

using testing::HasSubstr;

const std::string kBuses =
    "buses:\n"
    "  line: {family: point, link: {port: /dev/ttyS0}, devices: {axis1: {}}}\n"
    "  lift: {family: point, link: {port: /dev/ttyS0}, devices: {axis2: {}}}\n";
const std::string kReaches =
    "lcm: {url: 'udpm://239.255.76.67:7667?ttl=1', command_url: 'udpm://239.255.76.67:7668?ttl=1'}\n";

std::string ErrorsOf(const std::string& hosts, const std::string& lcm = kReaches) {
  ConfigErrors errors("m.yaml");
  static_cast<void>(ParseConfig("machine: press\n" + lcm + kBuses + hosts, errors));
  return errors.Text();
}

MachineConfig Press(const std::string& hosts) {
  ConfigErrors errors("m.yaml");
  auto machine = ParseConfig("machine: press\nrecorder: {logs: {all: {}}}\n" + kReaches + kBuses + hosts, errors);
  EXPECT_TRUE(machine) << errors.Text();
  return machine.value_or(MachineConfig{});
}

const std::string kTwo =
    "hosts:\n  plc1: {bridge: true, buses: [line]}\n  cell2: {buses: [lift], recorder: true}\n";

TEST(Hosts, TakeTheirPartOfTheMachine) {
  const MachineConfig machine = Press(kTwo);
  const Result<MachineConfig> plc1 = PartOn(machine, "plc1");
  const Result<MachineConfig> cell2 = PartOn(machine, "cell2");
  ASSERT_TRUE(plc1 && cell2);
  ASSERT_EQ(plc1->buses.size(), 1U);
  EXPECT_EQ(plc1->buses[0].name, "line");
  EXPECT_TRUE(plc1->runs_bridge);
  EXPECT_TRUE(plc1->recorder.logs.empty());
  ASSERT_EQ(cell2->buses.size(), 1U);
  EXPECT_EQ(cell2->buses[0].name, "lift");
  EXPECT_FALSE(cell2->runs_bridge);
  EXPECT_EQ(cell2->recorder.logs.size(), 1U);
  EXPECT_THAT(ErrorText(PartOn(machine, "desk")), HasSubstr("'desk', is not under `hosts`"));
}

TEST(Hosts, WithoutThemEveryHostHasAll) {
  ConfigErrors errors("m.yaml");
  const auto machine = ParseConfig(
      "machine: press\nbuses: {line: {family: point, link: {port: /dev/ttyS0}, devices: {axis1: {}}}}\n", errors);
  ASSERT_TRUE(machine) << errors.Text();
  EXPECT_EQ(PartOn(*machine, "anything")->buses.size(), 1U);
}

// Each host finds its own interface in the network. Every process reads the URLs only.
TEST(Hosts, TheUrlsCarryTheInterface) {
  ConfigErrors errors("m.yaml");
  const auto machine = ParseConfig(
      "machine: press\nlcm: {interface: 192.168.5.0/24, url: 'udpm://239.255.76.67:7667?ttl=1'}\n"
      "buses: {line: {family: point, link: {port: /dev/ttyS0}, devices: {axis1: {}}}}\n",
      errors);
  ASSERT_TRUE(machine) << errors.Text();
  EXPECT_EQ(machine->lcm.url, "udpm://239.255.76.67:7667?ttl=1&interface=192.168.5.0/24");
  EXPECT_EQ(machine->lcm.command_url, "udpm://239.255.76.67:7668?ttl=0&interface=192.168.5.0/24");
}

TEST(Hosts, PtpIsGrantedABoundOnlyByTheFile) {
  EXPECT_EQ(Press(kTwo + "time: {root: plc1, address: 192.0.2.1}\n").time.ptp_bound_us, 0);
  EXPECT_EQ(Press(kTwo + "time: {root: plc1, address: 192.0.2.1, ptp_bound_us: 250}\n").time.ptp_bound_us, 250);
  EXPECT_THAT(ErrorsOf(kTwo + "time: {root: plc1, address: 192.0.2.1, ptp_bound_us: -1}\n"),
              HasSubstr("ptp_bound_us"));
}

TEST(Hosts, AWrongAssignmentIsNamed) {
  EXPECT_EQ(ErrorsOf(kTwo), "") << "two hosts may have ports of one name";
  EXPECT_THAT(ErrorsOf("hosts: {a: {bridge: true, buses: [line]}}\n"), HasSubstr("bus 'lift' is on no host"));
  EXPECT_THAT(ErrorsOf("hosts: {a: {bridge: true, buses: [line, lift, lid]}}\n"),
              HasSubstr("there is no bus 'lid'"));
  EXPECT_THAT(ErrorsOf("hosts: {a: {bridge: true, buses: [line, lift]}, b: {buses: [line]}}\n"),
              HasSubstr("is on host a already"));
  EXPECT_THAT(ErrorsOf("hosts: {a: {buses: [line]}, b: {buses: [lift]}}\n"),
              HasSubstr("exactly one host needs `bridge: true`"));
  EXPECT_THAT(ErrorsOf("hosts: {a: {bridge: true, buses: [line, lift]}}\nrecorder: {logs: {all: {}}}\n"),
              HasSubstr("no host has `recorder: true`"));
  EXPECT_THAT(ErrorsOf(kTwo + "time: {root: desk, address: 192.0.2.1}\n"), HasSubstr("'desk', is not one of"));
  EXPECT_THAT(ErrorsOf("hosts: {'a b': {bridge: true, buses: [line, lift]}}\n"), HasSubstr("is no name of a host"));
  EXPECT_THAT(ErrorsOf("hosts: {a: {bridge: true, buses: [line, lift], busses: [x]}}\n"),
              HasSubstr("unknown key 'busses'"));
}

TEST(Hosts, MessagesMustLeaveAHost) { EXPECT_THAT(ErrorsOf(kTwo, ""), HasSubstr("messages do not leave a host")); }

}  // namespace
}  // namespace axlecast
