#include "tools/doctor/check.h"

#include <gmock/gmock.h>

#include <cerrno>

#include "tools/doctor/test_host.h"

namespace axlecast {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

constexpr const char* kData = "udpm://239.255.76.67:7667?ttl=0";

std::vector<std::string> LinesOf(const Symptom& symptom) {
  std::vector<std::string> lines;
  for (const Fix& fix : symptom.fixes) lines.push_back(LineOf(fix));
  return lines;
}

TEST(NetworkChecks, AMissingRouteIsToldOnceForBothPorts) {
  HostFacts host = GoodHost();
  for (auto& [url, group] : host.network.groups) group.route = {.error = ENETUNREACH, .interface = ""};
  const Symptoms symptoms = RunCheck("multicast_route", OneAxis(), host);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_TRUE(symptoms[0].safe);
  EXPECT_THAT(LinesOf(symptoms[0]),
              ElementsAre("ip link set lo up multicast on", "ip route replace 224.0.0.0/4 dev lo",
                          StartsWith("systemctl enable axlecast-multicast")));
  EXPECT_THAT(RunCheck("multicast_interface", OneAxis(), host), IsEmpty())
      << "a missing route is not reported twice";
  EXPECT_THAT(RunCheck("multicast_silent", OneAxis(), host), IsEmpty());
}

TEST(NetworkChecks, TheFlagOfLoopbackMattersWhereMessagesGoByIt) {
  HostFacts host = GoodHost();
  host.network.loopback.multicast = false;
  EXPECT_EQ(RunCheck("loopback_multicast", OneAxis(), host).size(), 1U);
  for (auto& [url, group] : host.network.groups) group.route.interface = "eth0";
  EXPECT_THAT(RunCheck("loopback_multicast", OneAxis(), host), IsEmpty());
  EXPECT_THAT(LinesOf(RunCheck("multicast_interface", OneAxis(), host).at(0)),
              ElementsAre("ip link set lo up multicast on", "ip route replace 239.255.76.67/32 dev lo",
                          StartsWith("systemctl enable axlecast-multicast")));
}

TEST(NetworkChecks, WithATtlMessagesMustLeaveTheHost) {
  const MachineConfig machine = OneAxis("", "lcm: {url: \"udpm://239.255.76.67:7667?ttl=1\"}");
  HostFacts host = GoodHost();
  host.network.groups[machine.lcm.url] = host.network.groups[kData];
  const Symptoms symptoms = RunCheck("multicast_interface", machine, host);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_THAT(symptoms[0].found, HasSubstr("uses lo"));
  EXPECT_FALSE(symptoms[0].safe) << "which interface leads to the others is not known";
}

// A host with these interfaces, of which LCM uses eth1 for the machine's data.
HostFacts HostWith(const MachineConfig& machine, std::vector<NetworkInterface> interfaces) {
  HostFacts host = GoodHost();
  host.network.groups[machine.lcm.url] = {
      .route = {.error = 0, .interface = "eth1"}, .interface_problem = "", .silence = ""};
  host.network.interfaces = std::move(interfaces);
  return host;
}

constexpr const char* kOneHop = "lcm: {url: \"udpm://239.255.76.67:7667?ttl=1\"}";
const NetworkInterface kLo = {.name = "lo", .index = 1, .up = true, .carrier = true, .loopback = true};
const NetworkInterface kEth0 = {.name = "eth0", .index = 2, .up = true, .carrier = true, .loopback = false};
const NetworkInterface kEth1 = {.name = "eth1", .index = 3, .up = true, .carrier = true, .loopback = false};

TEST(NetworkChecks, WithSeveralInterfacesTheFileMustNameOne) {
  const MachineConfig machine = OneAxis("", kOneHop);
  const Symptoms symptoms = RunCheck("interface_choice", machine, HostWith(machine, {kLo, kEth0, kEth1}));
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_THAT(symptoms[0].found, HasSubstr("several interfaces are up (eth0, eth1)"));
  EXPECT_THAT(LinesOf(symptoms[0]), ElementsAre(StartsWith("lcm: {interface: eth1}")));
  EXPECT_THAT(RunCheck("interface_choice", machine, HostWith(machine, {kLo, kEth1})), IsEmpty()) << "only one";
  NetworkInterface unplugged = kEth0;
  unplugged.carrier = false;
  EXPECT_THAT(RunCheck("interface_choice", machine, HostWith(machine, {unplugged, kEth1})), IsEmpty());
  const MachineConfig chosen = OneAxis("", "lcm: {interface: eth1, url: \"udpm://239.255.76.67:7667?ttl=1\"}");
  EXPECT_THAT(RunCheck("interface_choice", chosen, HostWith(chosen, {kLo, kEth0, kEth1})), IsEmpty());
  const MachineConfig local = OneAxis("", "lcm: {url: \"udpm://239.255.76.67:7667?ttl=0\"}");
  EXPECT_THAT(RunCheck("interface_choice", local, HostWith(local, {kLo, kEth0, kEth1})), IsEmpty());
}

TEST(NetworkChecks, TheProblemOfAChosenInterfaceIsReportedOnce) {
  const MachineConfig machine = OneAxis("", "lcm: {interface: eth1}");
  HostFacts host = HostWith(machine, {kLo});
  EXPECT_THAT(RunCheck("lcm_interface", machine, host), IsEmpty());
  EXPECT_THAT(RunCheck("multicast_interface", machine, host), IsEmpty()) << "chosen, also with ttl=0";
  host.network.groups[machine.lcm.command_url] = host.network.groups[machine.lcm.url];
  for (auto& [url, group] : host.network.groups) {
    group.interface_problem = "the interface eth1 is down: nothing until `ip link set eth1 up`";
  }
  const Symptoms symptoms = RunCheck("lcm_interface", machine, host);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_THAT(LinesOf(symptoms[0]), ElementsAre("ip link set eth1 up"));
  EXPECT_EQ(LcmInterfaces(host).at(machine.lcm.url), "eth1");
}

TEST(NetworkChecks, ALibraryThatForgedDatagramsBreakIsNamed) {
  HostFacts host = GoodHost();
  EXPECT_THAT(RunCheck("lcm_library", OneAxis(), host), IsEmpty());
  host.network.lcm_libraries = {"/usr/lib/x86_64-linux-gnu/liblcm.so.1.3.4"};
  const Symptoms symptoms = RunCheck("lcm_library", OneAxis(), host);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_THAT(symptoms[0].found, HasSubstr("liblcm.so.1.3.4: one forged datagram"));
  EXPECT_THAT(LinesOf(symptoms[0]),
              ElementsAre(HasSubstr("udp dport 7667 drop"), HasSubstr("udp dport 7668 drop")));
}

TEST(NetworkChecks, SilenceIsToldOfEachPort) {
  HostFacts host = GoodHost();
  host.network.groups[kData].silence = "multicast on this host is not usable: it did not come back\nFix it";
  const Symptoms symptoms = RunCheck("multicast_silent", OneAxis(), host);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_THAT(symptoms[0].found, AllOf(HasSubstr(":7667"), Not(HasSubstr("Fix it"))));
}

// The chain `input` of the table inet f with this policy, and rules with these expressions.
std::string Ruleset(const std::string& policy, const std::vector<std::string>& rules) {
  std::string text =
      R"({"nftables":[{"metainfo":{"version":"1.0.6"}},{"table":{"family":"inet","name":"f","handle":1}},)"
      R"({"chain":{"family":"inet","table":"f","name":"input","type":"filter","hook":"input","prio":0,"policy":")" +
      policy + "\"}}";
  for (const std::string& rule : rules) {
    text += R"(,{"rule":{"family":"inet","table":"f","chain":"input","expr":[)" + rule + "]}}";
  }
  return text + "]}";
}

std::string AcceptPort(int port) {
  return R"({"match":{"op":"==","left":{"payload":{"protocol":"udp","field":"dport"}},"right":)" +
         std::to_string(port) + R"(}},{"accept":null})";
}

constexpr const char* kFar = "udpm://239.255.76.67:7667?ttl=1";

// A host whose datagrams for 239.255.76.67:7667 come from the network.
HostFacts FarHost(const std::string& ruleset) {
  HostFacts host = GoodHost();
  host.network.groups[kFar] = {.route = {.error = 0, .interface = "eth0"}, .interface_problem = "", .silence = ""};
  host.network.firewall = ruleset;
  return host;
}

TEST(NetworkChecks, AnActiveFirewallIsNamedUnlessItAcceptsThePort) {
  const MachineConfig machine = OneAxis("", std::string("lcm: {url: \"") + kFar + "\"}");
  const auto count = [&](const std::string& policy, const std::vector<std::string>& rules) {
    return RunCheck("firewall", machine, FarHost(Ruleset(policy, rules))).size();
  };
  EXPECT_EQ(count("accept", {}), 0U) << "nothing can drop";
  EXPECT_EQ(count("drop", {}), 1U);
  EXPECT_EQ(count("accept", {R"({"drop":null})"}), 1U);
  EXPECT_EQ(count("drop", {AcceptPort(7669)}), 1U);
  EXPECT_EQ(count("drop", {AcceptPort(7667)}), 0U);
  const Symptoms symptoms = RunCheck("firewall", machine, FarHost(Ruleset("drop", {})));
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_THAT(symptoms[0].found, HasSubstr("chain input of the table inet f"));
  EXPECT_THAT(LinesOf(symptoms[0]),
              ElementsAre("nft insert rule inet f input udp dport 7667 ip daddr 239.255.76.67 accept"));
  EXPECT_FALSE(symptoms[0].safe);
}

TEST(NetworkChecks, AFirewallMattersWithinThisHostOnlyIfNoDatagramComesBack) {
  HostFacts host = GoodHost();
  host.network.firewall = Ruleset("drop", {});
  EXPECT_THAT(RunCheck("firewall", OneAxis(), host), IsEmpty());
  host.network.groups[kData].silence = "it did not come back";
  EXPECT_EQ(RunCheck("firewall", OneAxis(), host).size(), 1U);
}

TEST(NetworkChecks, ATextThatIsNoRulesetGivesNoSymptom) {
  const MachineConfig machine = OneAxis("", std::string("lcm: {url: \"") + kFar + "\"}");
  for (const char* text : {"", "{", "[]", "{}", R"({"nftables":{}})", R"({"nftables":[7]})", R"({"nftables":[{}]})",
                           R"({"nftables":[{"chain":7},{"rule":{"expr":7}}]})",
                           R"({"nftables":[{"chain":{"hook":"input","family":"ip6","policy":"drop"}}]})"}) {
    EXPECT_THAT(RunCheck("firewall", machine, FarHost(text)), IsEmpty()) << text;
  }
}

struct BufferCase {
  const char* lcm;
  const char* recorder;
  std::int64_t max;
  std::int64_t wanted;  // 0: nothing is found
};

TEST(NetworkChecks, TheLargestBufferThatIsAskedForMustBeAllowed) {
  const BufferCase cases[] = {
      {"", "", 4096, 0},
      {"lcm: {url: \"udpm://239.255.76.67:7667?recv_buf_size=8192\"}", "", 4096, 8192},
      {"lcm: {url: \"udpm://239.255.76.67:7667?recv_buf_size=8192\"}", "", 8192, 0},
      {"", "recorder: {logs: {a: {quota: 2MB}}}", 33'554'431, 33'554'432},
      {"", "recorder: {logs: {a: {quota: 2MB}}}", 33'554'432, 0},
  };
  for (const BufferCase& one : cases) {
    HostFacts host = GoodHost();
    host.network.receive_max = one.max;
    const Symptoms symptoms =
        RunCheck("receive_buffer_max", OneAxis("", std::string(one.lcm) + '\n' + one.recorder), host);
    ASSERT_EQ(symptoms.size(), one.wanted > 0 ? 1U : 0U) << one.lcm << one.recorder << one.max;
    if (one.wanted == 0) continue;
    EXPECT_EQ(LineOf(symptoms[0].fixes[0]),
              "echo " + std::to_string(one.wanted) + " > /proc/sys/net/core/rmem_max");
  }
  HostFacts unknown = GoodHost();
  unknown.network.receive_max = std::nullopt;
  EXPECT_THAT(RunCheck("receive_buffer_max", OneAxis("", "recorder: {logs: {a: {quota: 2MB}}}"), unknown),
              IsEmpty());
}

TEST(NetworkChecks, ATenthOfASecondFitsTheDefaultBuffer) {
  HostFacts host = GoodHost();
  host.network.receive_default = 12'800;  // 100 messages a second of 1280 bytes each
  EXPECT_THAT(RunCheck("receive_buffer_default", OneAxis(), host), IsEmpty());
  host.network.receive_default = 12'799;
  const Symptoms symptoms = RunCheck("receive_buffer_default", OneAxis(), host);
  ASSERT_EQ(symptoms.size(), 1U);
  EXPECT_EQ(LineOf(symptoms[0].fixes[1]),
            "echo 'net.core.rmem_default = 2097152' >> /etc/sysctl.d/60-axlecast.conf");
}

// Seen: every boot id that somebody invented was kept, and every name was printed.
TEST(NetworkChecks, InventedDriversAreBoundedAndDisplaceNone) {
  HostFacts host = GoodHost();
  const MachineConfig machine = OneAxis();
  ReceivedDrivers drivers(machine);
  for (int i = 0; i < 10'000; ++i) {
    drivers.On("DRIVER_STATUS/x" + std::to_string(i), i);
    if (i > 5'000) drivers.On("DRIVER_STATUS/b0", i);
  }
  host.network.drivers = drivers.All();
  EXPECT_EQ(host.network.drivers.size(), ReceivedDrivers::kMaxOthers + ReceivedDrivers::kMaxBoots);
  EXPECT_EQ(RunCheck("duplicate_driver", machine, host).size(), 1U);
  const Symptoms others = RunCheck("other_machine", machine, host);
  ASSERT_EQ(others.size(), 1U);
  EXPECT_LT(others[0].found.size(), 300U);
  EXPECT_THAT(others[0].found, HasSubstr("and 94 more"));
}

TEST(NetworkChecks, EachFaultOfTheRunningMachineIsFound) {
  HostFacts host = GoodHost();
  EXPECT_THAT(RunCheck("machine_faults", OneAxis(), host), IsEmpty());
  host.network.machine_faults = {"axis1: DEGRADED (battery\x1b)", "b0: DOWN"};
  const Symptoms symptoms = RunCheck("machine_faults", OneAxis(), host);
  ASSERT_EQ(symptoms.size(), 2U);
  EXPECT_EQ(symptoms[0].found, "the machine runs, but is not good: axis1: DEGRADED (battery?)");
  EXPECT_EQ(LineOf(symptoms[1].fixes[0]), "axlecast status m.yaml    # the current state");
  EXPECT_FALSE(symptoms[0].safe);
}

TEST(NetworkChecks, DriversOfOthersAndTwoOfOne) {
  HostFacts host = GoodHost();
  host.network.drivers = {{"DRIVER_STATUS/b0", 1}};
  EXPECT_THAT(RunCheck("other_machine", OneAxis(), host), IsEmpty());
  EXPECT_THAT(RunCheck("duplicate_driver", OneAxis(), host), IsEmpty());
  host.network.drivers = {
      {"DRIVER_STATUS/b0", 1}, {"DRIVER_STATUS/b0", 2}, {"DRIVER_STATUS/b7", 3}, {"far/DRIVER_STATUS/b0", 4}};
  const Symptoms others = RunCheck("other_machine", OneAxis(), host);
  ASSERT_EQ(others.size(), 1U);
  EXPECT_THAT(others[0].found, HasSubstr("DRIVER_STATUS/b7, far/DRIVER_STATUS/b0"));
  const Symptoms twins = RunCheck("duplicate_driver", OneAxis(), host);
  ASSERT_EQ(twins.size(), 1U);
  EXPECT_THAT(twins[0].found, HasSubstr("2 drivers of bus b0"));
}

}  // namespace
}  // namespace axlecast
