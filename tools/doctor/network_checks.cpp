#include "tools/doctor/network_checks.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <map>
#include <set>
#include <string>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/config/machine_config.h"
#include "core/messages/lcm_url.h"
#include "platform/net/multicast_port.h"
#include "tools/doctor/firewall.h"

namespace axlecast {
namespace {

constexpr const char* kSysctlFile = "/etc/sysctl.d/60-axlecast.conf";
// A message of some 150 bytes as the kernel accounts for it in a socket's buffer.
constexpr double kDatagramCost = 1'280;
// That a process may sleep on a busy host without losing messages.
constexpr double kRoom = 0.1;  // s
constexpr std::int64_t kUsualBuffer = 2 << 20;

struct Group {
  std::string text;  // of the machine's file
  LcmUrl url;
  const GroupFacts* facts = nullptr;
};

std::vector<Group> GroupsOf(const MachineConfig& machine, const HostFacts& host) {
  std::vector<Group> groups;
  for (const std::string& text : {machine.lcm.url, machine.lcm.command_url}) {
    const auto facts = host.network.groups.find(text);
    if (facts != host.network.groups.end()) groups.push_back({text, ParseLcmUrl(text), &facts->second});
  }
  return groups;
}

Fix AtEveryStart() { return Tell("systemctl enable axlecast-multicast    # of the package: at every start"); }

Symptom RouteFinding(const Group& group) {
  Symptom finding{.found = "there is no route to the multicast group " + group.url.group + " (" +
                           std::strerror(group.facts->route.error) + ')',
                  .fixes = {},
                  .safe = group.url.ttl == 0};
  if (finding.safe) {
    finding.fixes = {Run({"ip", "link", "set", "lo", "up", "multicast", "on"}),
                     Run({"ip", "route", "replace", "224.0.0.0/4", "dev", "lo"}), AtEveryStart()};
  } else {
    finding.fixes = {Tell("ip route add 224.0.0.0/4 dev INTERFACE    # the one that leads to the other hosts")};
  }
  return finding;
}

Symptom InterfaceFinding(const Group& group) {
  const std::string& interface = group.facts->route.interface;
  if (group.url.ttl == 0) {
    return {.found = group.text + " stays on this host (ttl=0), but goes by " + interface,
            .fixes = {Run({"ip", "link", "set", "lo", "up", "multicast", "on"}),
                      Run({"ip", "route", "replace", group.url.group + "/32", "dev", "lo"}), AtEveryStart()},
            .safe = true};
  }
  return {.found = group.text + " is for other hosts (ttl=" + std::to_string(group.url.ttl) + "), but goes by lo",
          .fixes = {Tell("ip route replace " + group.url.group +
                         "/32 dev INTERFACE    # the one that leads to the other hosts")},
          .safe = false};
}

// The two URLs of a machine mostly have one group: it is told once.
template <typename Wrong>
Symptoms ByGroup(const std::vector<Group>& groups, Wrong wrong, Symptom (*tell)(const Group&)) {
  Symptoms findings;
  std::set<std::string> told;
  for (const Group& group : groups) {
    if (wrong(group) && told.insert(group.url.group).second) findings.push_back(tell(group));
  }
  return findings;
}

Symptom BufferFinding(const char* name, std::int64_t found, std::int64_t wanted, const std::string& why) {
  const std::string key = std::string("net.core.") + name;
  return {.found = key + " is " + std::to_string(found) + " bytes: " + why,
          .fixes = {Write(std::string("/proc/sys/net/core/") + name, std::to_string(wanted)),
                    Append(kSysctlFile, key + " = " + std::to_string(wanted))},
          .safe = true};
}

}  // namespace

Symptoms CheckMulticastRoute(const MachineConfig& machine, const HostFacts& host) {
  return ByGroup(
      GroupsOf(machine, host), [](const Group& group) { return group.facts->route.error != 0; }, &RouteFinding);
}

Symptoms CheckLoopbackMulticast(const MachineConfig& machine, const HostFacts& host) {
  const LoopbackState& loopback = host.network.loopback;
  if (!loopback.known || (loopback.up && loopback.multicast)) return {};
  const std::vector<Group> groups = GroupsOf(machine, host);
  const bool used = std::any_of(groups.begin(), groups.end(), [](const Group& group) {
    return group.url.ttl == 0 && (group.facts->route.error != 0 || group.facts->route.interface == "lo");
  });
  if (!used) return {};
  return {{.found = loopback.up ? "the loopback interface lo has no MULTICAST flag"
                                : "the loopback interface lo is down",
           .fixes = {Run({"ip", "link", "set", "lo", "up", "multicast", "on"}), AtEveryStart()},
           .safe = true}};
}

Symptoms CheckMulticastInterface(const MachineConfig& machine, const HostFacts& host) {
  const auto wrong = [](const Group& group) {
    const std::string& interface = group.facts->route.interface;
    return !interface.empty() && (group.url.ttl == 0) != (interface == "lo");
  };
  return ByGroup(GroupsOf(machine, host), wrong, &InterfaceFinding);
}

Symptoms CheckMulticastSilent(const MachineConfig& machine, const HostFacts& host) {
  Symptoms findings;
  for (const Group& group : GroupsOf(machine, host)) {
    if (group.facts->route.error != 0 || group.facts->silence.empty()) continue;
    const std::string& why = group.facts->silence;
    findings.push_back(
        {.found = "nothing that is sent to " + group.text + " comes back: " + why.substr(0, why.find('\n')),
         .fixes = {Tell("nft list ruleset    # a rule of the firewall drops udp port " +
                        std::to_string(group.url.port) + '?')},
         .safe = false});
  }
  return findings;
}

Symptoms CheckFirewall(const MachineConfig& machine, const HostFacts& host) {
  Symptoms findings;
  for (const Group& group : GroupsOf(machine, host)) {
    const FirewallPacket packet{.group = group.url.group,
                                .port = group.url.port,
                                .interface = group.url.ttl == 0 ? "lo" : group.facts->route.interface};
    const std::optional<FirewallChain> chain = DroppingChain(host.network.firewall, packet);
    if (!chain) continue;
    const std::string accept =
        "udp dport " + std::to_string(group.url.port) + " ip daddr " + group.url.group + " accept";
    findings.push_back({.found = "the chain " + chain->name + " of the table " + chain->family + ' ' +
                                 chain->table + " drops what comes for " + group.text,
                        .fixes = {Tell("nft insert rule " + chain->family + ' ' + chain->table + ' ' + chain->name +
                                       ' ' + accept)},
                        .safe = false});
  }
  return findings;
}

Symptoms CheckReceiveBufferMax(const MachineConfig& machine, const HostFacts& host) {
  if (!host.network.receive_max) return {};
  std::int64_t wanted = 0;
  for (const std::string& text : {machine.lcm.url, machine.lcm.command_url}) {
    const LcmUrl url = ParseLcmUrl(text);
    wanted = std::max(wanted, url.recv_buf_size);
    const bool recorded = !machine.recorder.logs.empty() && url.recv_buf_size == 0 && !url.in_process;
    if (recorded) wanted = std::max(wanted, MulticastPort::kDefaultBuffer);
  }
  if (*host.network.receive_max >= wanted) return {};
  const std::string who =
      machine.recorder.logs.empty() ? "recv_buf_size of lcm asks for " : "the recorder asks for ";
  return {BufferFinding("rmem_max", *host.network.receive_max, wanted, who + std::to_string(wanted))};
}

Symptoms CheckReceiveBufferDefault(const MachineConfig& machine, const HostFacts& host) {
  const LcmUrl url = ParseLcmUrl(machine.lcm.url);
  if (!host.network.receive_default || url.in_process || url.recv_buf_size > 0) return {};
  const double rate = MessageRate(machine);
  const double needed = rate * kRoom * kDatagramCost;
  const auto has = static_cast<double>(*host.network.receive_default);
  if (has >= needed) return {};
  const auto wanted = std::max<std::int64_t>(
      kUsualBuffer, static_cast<std::int64_t>(std::bit_ceil(static_cast<std::uint64_t>(needed))));
  Symptom finding =
      BufferFinding("rmem_default", *host.network.receive_default, wanted,
                    std::to_string(static_cast<int>(1'000 * has / kDatagramCost / rate)) + " ms of the machine's " +
                        std::to_string(static_cast<int>(rate)) + " messages a second");
  finding.fixes.push_back(Tell("or in the machine's file, lcm.url: ?recv_buf_size=" + std::to_string(wanted) +
                               "    # and net.core.rmem_max as much"));
  return {finding};
}

// No release has the repair: 1.5.2 is the newest that was looked at. A file's name tells its ABI's version, not the release.
Symptoms CheckLcmLibrary(const MachineConfig& machine, const HostFacts& host) {
  if (host.network.lcm_libraries.empty()) return {};
  Symptom finding{.found = Listed(host.network.lcm_libraries) +
                           ": one forged datagram makes a program that receives through it write out of bounds "
                           "(LCM's pull request 628, not in any release up to 1.5.2)",
                  .fixes = {},
                  .safe = false};
  for (const std::string& text : {machine.lcm.url, machine.lcm.command_url}) {
    const LcmUrl url = ParseLcmUrl(text);
    if (url.in_process || !url.problem.empty() || url.ttl > 0) continue;
    finding.fixes.push_back(Tell("nft add rule inet filter input iifname != lo udp dport " +
                                 std::to_string(url.port) + " drop    # ttl=0: nothing for it comes from outside"));
  }
  if (finding.fixes.empty()) {
    finding.fixes.push_back(Tell("let only hosts that you trust onto the segment (ttl above 0)"));
  }
  return {finding};
}

Symptoms CheckOtherMachine(const MachineConfig& machine, const HostFacts& host) {
  std::set<std::string> others;
  for (const auto& [channel, boot_id] : host.network.drivers) {
    if (!IsDriverOf(machine, channel)) others.insert(channel);
  }
  if (others.empty()) return {};
  constexpr std::size_t kNamed = 6;
  std::vector<std::string> named(others.begin(), others.end());
  std::string more;
  if (named.size() > kNamed) {
    more = " and " + std::to_string(named.size() - kNamed) + " more";
    named.resize(kNamed);
  }
  return {{.found = "drivers that the file does not know are heard on " + machine.lcm.command_url + ": " +
                    Printable(Listed(named)) + more,
           .fixes = {Tell("give one of the machines other ports in its file:"),
                     Tell("lcm: {url: \"udpm://239.255.76.67:7677?ttl=0\", command_url: "
                          "\"udpm://239.255.76.67:7678?ttl=0\"}")},
           .safe = false}};
}

Symptoms CheckDuplicateDriver(const MachineConfig& machine, const HostFacts& host) {
  std::map<std::string, std::set<std::int64_t>> boots;
  for (const auto& [channel, boot_id] : host.network.drivers) {
    if (IsDriverOf(machine, channel)) boots[BusOfChannel(channel)].insert(boot_id);
  }
  Symptoms findings;
  for (const auto& [bus, ids] : boots) {
    if (ids.size() < 2) continue;
    findings.push_back({.found = std::to_string(ids.size()) + " drivers of bus " + bus + " are running",
                        .fixes = {Tell("pgrep -af -- '--bus " + bus + "'    # on each host; end all but one")},
                        .safe = false});
  }
  return findings;
}

Symptoms CheckMachineFaults(const MachineConfig& machine, const HostFacts& host) {
  Symptoms findings;
  for (const std::string& fault : host.network.machine_faults) {
    findings.push_back({.found = "the machine runs and is not good: " + Printable(fault),
                        .fixes = {Tell("axlecast status " + machine.file + "    # all of it, at any time"),
                                  Tell("what to do about it: docs/troubleshooting.md")},
                        .safe = false});
  }
  return findings;
}

}  // namespace axlecast
