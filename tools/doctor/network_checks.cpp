#include "tools/doctor/check.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "core/base/spelling.h"
#include "core/base/text.h"
#include "core/config/machine_config.h"
#include "core/messages/lcm_url.h"
#include "platform/net/multicast_port.h"

namespace axlecast {
namespace {

using Json = nlohmann::json;

constexpr const char* kSysctlFile = "/etc/sysctl.d/60-axlecast.conf";
constexpr double kDatagramCost = 1'280;  // bytes that a message of about 150 bytes takes in a socket's buffer
constexpr double kMaxDelay = 0.1;        // s; a process must not lose messages during this time
constexpr std::int64_t kMinBuffer = 2 << 20;

struct Group {
  std::string text;  // from the machine file
  LcmUrl url;
  const GroupFacts* facts = nullptr;
};

// Returns an empty URL if `text` is not valid: no check applies to it.
LcmUrl UrlOf(const std::string& text) { return ParseLcmUrl(text).value_or(LcmUrl{}); }

std::vector<Group> GroupsOf(const MachineConfig& machine, const HostFacts& host) {
  std::vector<Group> groups;
  for (const std::string& text : {machine.lcm.url, machine.lcm.command_url}) {
    const auto facts = host.network.groups.find(text);
    if (facts != host.network.groups.end()) groups.push_back({text, UrlOf(text), &facts->second});
  }
  return groups;
}

Fix AtEveryStart() {
  return Manual("systemctl enable axlecast-multicast    # unit of the package: at every start");
}

Symptom RouteSymptom(const Group& group) {
  Symptom symptom{.found = "there is no route to the multicast group " + group.url.group + " (" +
                           std::strerror(group.facts->route.error) + ')',
                  .safe = group.url.ttl == 0};
  if (symptom.safe) {
    symptom.fixes = {Run({"ip", "link", "set", "lo", "up", "multicast", "on"}),
                     Run({"ip", "route", "replace", "224.0.0.0/4", "dev", "lo"}), AtEveryStart()};
  } else {
    symptom.fixes = {Manual("ip route add 224.0.0.0/4 dev INTERFACE    # the interface to the other hosts")};
  }
  return symptom;
}

Symptom InterfaceSymptom(const Group& group) {
  const std::string& interface = group.facts->route.interface;
  if (group.url.ttl == 0) {
    return {.found = group.text + " stays on this host (ttl=0), but uses " + interface,
            .fixes = {Run({"ip", "link", "set", "lo", "up", "multicast", "on"}),
                      Run({"ip", "route", "replace", group.url.group + "/32", "dev", "lo"}), AtEveryStart()},
            .safe = true};
  }
  const std::string found =
      group.text + " is for other hosts (ttl=" + std::to_string(group.url.ttl) + "), but uses lo";
  if (!group.url.interface.empty()) {
    return {.found = found, .fixes = {Manual("set `lcm: {interface: …}` to the interface to the other hosts")}};
  }
  return {.found = found,
          .fixes = {Manual("ip route replace " + group.url.group +
                           "/32 dev INTERFACE    # the interface to the other hosts")}};
}

// Reports each group once: the two URLs of a machine usually have the same group.
template <typename IsWrong>
Symptoms ByGroup(const std::vector<Group>& groups, IsWrong is_wrong, Symptom (*describe)(const Group&)) {
  Symptoms symptoms;
  std::set<std::string> reported;
  for (const Group& group : groups) {
    if (is_wrong(group) && reported.insert(group.url.group).second) symptoms.push_back(describe(group));
  }
  return symptoms;
}

std::string Text(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

// Returns true if the rule accepts datagrams because of their UDP port. Other conditions of the rule are not examined.
bool AcceptsPort(const Json& rule, std::int64_t port) {
  const Json match = {
      {"op", "=="}, {"left", {{"payload", {{"protocol", "udp"}, {"field", "dport"}}}}}, {"right", port}};
  const auto expressions = rule.find("expr");
  if (expressions == rule.end() || !expressions->is_array()) return false;
  return std::find(expressions->begin(), expressions->end(), Json{{"match", match}}) != expressions->end() &&
         std::find(expressions->begin(), expressions->end(), Json{{"accept", nullptr}}) != expressions->end();
}

// Returns "FAMILY TABLE CHAIN" for each chain at the input hook that can drop datagrams (its policy is drop, or it has
// rules) and has no rule that accepts this port. `ruleset`: libnftables-json(5), which contains iptables rules too. `ip`: "ip" or
// "ip6", the family of nft besides "inet".
std::vector<std::string> InputChains(const Json& ruleset, std::int64_t port, const std::string& ip) {
  if (!ruleset.is_object() || !ruleset.contains("nftables") || !ruleset["nftables"].is_array()) return {};
  struct Chain {
    bool may_drop = false;
    bool accepts = false;
  };
  std::map<std::string, Chain> chains;
  for (const Json& object : ruleset["nftables"]) {  // chains come before their rules
    if (!object.is_object() || object.empty() || !object.front().is_object()) continue;
    const Json& content = object.front();
    const std::string family = Text(content, "family");
    const std::string table = family + ' ' + Text(content, "table") + ' ';
    if (object.contains("chain") && Text(content, "hook") == "input" && (family == "inet" || family == ip)) {
      chains[table + Text(content, "name")].may_drop = Text(content, "policy") == "drop";
    }
    const auto chain = chains.find(table + Text(content, "chain"));
    if (!object.contains("rule") || chain == chains.end()) continue;
    chain->second.may_drop = true;
    chain->second.accepts = chain->second.accepts || AcceptsPort(content, port);
  }
  std::vector<std::string> found;
  for (const auto& [name, chain] : chains) {
    if (chain.may_drop && !chain.accepts) found.push_back(name);
  }
  return found;
}

// Returns "chain CHAIN of the table FAMILY TABLE".
std::string ChainText(const std::string& chain) {
  const std::size_t name = chain.rfind(' ');
  return "chain " + chain.substr(name + 1) + " of the table " + chain.substr(0, name);
}

Symptom BufferSymptom(const char* name, std::int64_t bytes, std::int64_t needed, const std::string& reason) {
  const std::string key = std::string("net.core.") + name;
  return {.found = key + " is " + std::to_string(bytes) + " bytes: " + reason,
          .fixes = {Write(std::string("/proc/sys/net/core/") + name, std::to_string(needed)),
                    Append(kSysctlFile, key + " = " + std::to_string(needed))},
          .safe = true};
}

Symptoms CheckMulticastRoute(const MachineConfig& machine, const HostFacts& host) {
  return ByGroup(
      GroupsOf(machine, host), [](const Group& group) { return group.facts->route.error != 0; }, &RouteSymptom);
}

Symptoms CheckLcmInterface(const MachineConfig& machine, const HostFacts& host) {
  const auto wrong = [](const Group& group) { return !group.facts->interface_problem.empty(); };
  return ByGroup(GroupsOf(machine, host), wrong, [](const Group& group) -> Symptom {
    const std::string& problem = group.facts->interface_problem;
    const std::string& name = group.facts->route.interface;
    if (problem.find("no carrier") != std::string::npos) {
      return {.found = problem,
              .fixes = {Manual("ip link show " + name + "    # NO-CARRIER until the cable is good")}};
    }
    if (problem.ends_with(" up`")) return {.found = problem, .fixes = {Run({"ip", "link", "set", name, "up"})}};
    return {.found = problem,
            .fixes = {Manual(
                "ip -brief address    # what exists; set `lcm: {interface: …}` in the machine file to one")}};
  });
}

Symptoms CheckInterfaceChoice(const MachineConfig& machine, const HostFacts& host) {
  std::vector<std::string> usable;
  for (const NetworkInterface& each : host.network.interfaces) {
    if (each.up && each.carrier && !each.loopback) usable.push_back(each.name);
  }
  if (usable.size() < 2) return {};
  Symptoms symptoms;
  for (const Group& group : GroupsOf(machine, host)) {
    const std::string& used = group.facts->route.interface;
    if (group.url.ttl == 0 || !group.url.interface.empty() || used.empty() || used == "lo") continue;
    symptoms.push_back({.found = "several interfaces are up (" + Listed(usable) + "), and " + group.text +
                                 " uses the one of its route, " + used,
                        .fixes = {Manual("lcm: {interface: " + used + "}    # in the machine file")}});
    break;  // one line of the file serves both URLs
  }
  return symptoms;
}

Symptoms CheckLoopbackMulticast(const MachineConfig& machine, const HostFacts& host) {
  const LoopbackState& loopback = host.network.loopback;
  if (!loopback.known || (loopback.up && loopback.multicast)) return {};
  const std::vector<Group> groups = GroupsOf(machine, host);
  const bool used = std::ranges::any_of(groups, [](const Group& group) {
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
    if (interface.empty() || (group.url.ttl == 0 && !group.url.interface.empty())) return false;
    return (group.url.ttl == 0) != (interface == "lo");
  };
  return ByGroup(GroupsOf(machine, host), wrong, &InterfaceSymptom);
}

Symptoms CheckMulticastSilent(const MachineConfig& machine, const HostFacts& host) {
  Symptoms symptoms;
  for (const Group& group : GroupsOf(machine, host)) {
    if (group.facts->route.error != 0 || group.facts->silence.empty()) continue;
    const std::string& reason = group.facts->silence;
    symptoms.push_back(
        {.found = "no datagram to " + group.text + " comes back: " + reason.substr(0, reason.find('\n')),
         .fixes = {Manual("nft list ruleset    # look for a rule that drops udp port " +
                          std::to_string(group.url.port))}});
  }
  return symptoms;
}

Symptoms CheckFirewall(const MachineConfig& machine, const HostFacts& host) {
  const Json ruleset = Json::parse(host.network.firewall, nullptr, false);
  std::map<std::string, Symptom> symptoms;  // by chain
  for (const Group& group : GroupsOf(machine, host)) {
    // With ttl=0, the datagram to this host itself has shown that the rules accept it.
    if (group.url.ttl == 0 && group.facts->route.error == 0 && group.facts->silence.empty()) continue;
    const std::string ip = group.url.IsIPv6() ? "ip6" : "ip";
    for (const std::string& chain : InputChains(ruleset, group.url.port, ip)) {
      Symptom& symptom = symptoms[chain];
      symptom.safe = false;
      symptom.found += symptom.found.empty() ? "a firewall is active: the " + ChainText(chain) +
                                                   " may drop datagrams to " + group.text
                                             : " and " + group.text;
      symptom.fixes.push_back(Manual("nft insert rule " + chain + " udp dport " + std::to_string(group.url.port) +
                                     ' ' + ip + " daddr " + group.url.group + " accept"));
    }
  }
  Symptoms found;
  for (auto& [chain, symptom] : symptoms) found.push_back(std::move(symptom));
  return found;
}

Symptoms CheckReceiveBufferMax(const MachineConfig& machine, const HostFacts& host) {
  if (!host.network.receive_max) return {};
  std::int64_t needed = 0;
  for (const std::string& text : {machine.lcm.url, machine.lcm.command_url}) {
    const LcmUrl url = UrlOf(text);
    needed = std::max(needed, url.recv_buf_size);
    const bool recorded = !machine.recorder.logs.empty() && url.recv_buf_size == 0 && !url.in_process;
    if (recorded) needed = std::max(needed, MulticastPort::kDefaultBuffer);
  }
  if (*host.network.receive_max >= needed) return {};
  const std::string requester =
      machine.recorder.logs.empty() ? "recv_buf_size of lcm requests " : "the recorder requests ";
  return {BufferSymptom("rmem_max", *host.network.receive_max, needed, requester + std::to_string(needed))};
}

Symptoms CheckReceiveBufferDefault(const MachineConfig& machine, const HostFacts& host) {
  const LcmUrl url = UrlOf(machine.lcm.url);
  if (!host.network.receive_default || url.in_process || url.recv_buf_size > 0) return {};
  const double rate = MessageRate(machine);
  const double needed = rate * kMaxDelay * kDatagramCost;
  const auto has = static_cast<double>(*host.network.receive_default);
  if (has >= needed) return {};
  const auto size = std::max<std::int64_t>(
      kMinBuffer, static_cast<std::int64_t>(std::bit_ceil(static_cast<std::uint64_t>(needed))));
  Symptom symptom =
      BufferSymptom("rmem_default", *host.network.receive_default, size,
                    std::to_string(static_cast<int>(1'000 * has / kDatagramCost / rate)) + " ms of the machine's " +
                        std::to_string(static_cast<int>(rate)) + " messages per second");
  symptom.fixes.push_back(Manual("or in the machine file, lcm.url: ?recv_buf_size=" + std::to_string(size) +
                                 "    # and at least the same net.core.rmem_max"));
  return {symptom};
}

// No release up to 1.5.2 contains the fix. The file name has the version of the ABI, not of the release.
Symptoms CheckLcmLibrary(const MachineConfig& machine, const HostFacts& host) {
  if (host.network.lcm_libraries.empty()) return {};
  Symptom symptom{.found = Listed(host.network.lcm_libraries) +
                           ": one forged datagram makes a program that receives through it write out of bounds "
                           "(LCM's pull request 628, not in any release up to 1.5.2)"};
  for (const std::string& text : {machine.lcm.url, machine.lcm.command_url}) {
    const auto url = ParseLcmUrl(text);
    if (!url || url->in_process || url->ttl > 0 || url->IsIPv6()) continue;
    symptom.fixes.push_back(Manual("nft add rule inet filter input iifname != lo udp dport " +
                                   std::to_string(url->port) + " drop    # ttl=0: other hosts send nothing to it"));
  }
  if (symptom.fixes.empty()) {
    symptom.fixes.push_back(Manual("allow only trusted hosts on the network segment (ttl above 0)"));
  }
  return {symptom};
}

// Returns the line `lcm:` of a machine file that differs from this machine's in its ports only.
std::string OtherPorts(const MachineConfig& machine) {
  const auto moved = [](const std::string& text) {
    const auto url = ParseLcmUrl(text);
    if (!url || url->in_process) return text;
    const std::string group = url->IsIPv6() ? '[' + url->group + ']' : url->group;
    return "udpm://" + group + ':' + std::to_string(url->port + 10) + "?ttl=" + std::to_string(url->ttl);
  };
  const std::string interface = UrlOf(machine.lcm.url).interface;
  return "lcm: {url: \"" + moved(machine.lcm.url) + "\", command_url: \"" + moved(machine.lcm.command_url) + '"' +
         (interface.empty() ? "" : ", interface: " + interface) + "}";
}

// Returns a prefix for the channels of a machine. The file allows 16 bytes.
std::string PrefixFor(const OtherMachine& machine) {
  return (machine.name.empty() ? "machine2" : machine.name.substr(0, 15)) + "/";
}

Symptoms CheckOtherMachine(const MachineConfig& machine, const HostFacts& host) {
  if (!host.network.machines.empty()) {
    return {
        {.found = Printable(NamesOf(host.network.machines)) + " sends on the channels of machine " +
                  Quoted(machine.machine) + ", on " + machine.lcm.command_url,
         .fixes = {Manual("stop neither: give one of the machines a prefix in its machine file, and restart it:"),
                   Manual("lcm: {prefix: \"" + PrefixFor(host.network.machines.front()) + "\"}"),
                   Manual("or other ports:"), Manual(OtherPorts(machine))}}};
  }
  std::set<std::string> others;
  for (const auto& [channel, boot_id] : host.network.drivers) {
    if (!IsDriverOf(machine, channel)) others.insert(channel);
  }
  if (others.empty()) return {};
  constexpr std::size_t kMaxNames = 6;
  std::vector<std::string> named(others.begin(), others.end());
  std::string more;
  if (named.size() > kMaxNames) {
    more = " and " + std::to_string(named.size() - kMaxNames) + " more";
    named.resize(kMaxNames);
  }
  return {{.found = "drivers that are not in the machine file send on " + machine.lcm.command_url + ": " +
                    Printable(Listed(named)) + more,
           .fixes = {Manual("give one of the machines other ports in its machine file:"),
                     Manual(OtherPorts(machine))}}};
}

Symptoms CheckDuplicateDriver(const MachineConfig& machine, const HostFacts& host) {
  std::map<std::string, std::set<std::int64_t>> boots;
  for (const auto& [channel, boot_id] : host.network.drivers) {
    if (IsDriverOf(machine, channel)) boots[BusOfChannel(channel)].insert(boot_id);
  }
  Symptoms symptoms;
  for (const auto& [bus, ids] : boots) {
    if (ids.size() < 2) continue;
    symptoms.push_back({.found = std::to_string(ids.size()) + " drivers of bus " + bus + " are running",
                        .fixes = {Manual("pgrep -af -- '--bus " + bus + "'    # on each host; stop all but one")}});
  }
  return symptoms;
}

Symptoms CheckMachineFaults(const MachineConfig& machine, const HostFacts& host) {
  Symptoms symptoms;
  for (const std::string& fault : host.network.machine_faults) {
    symptoms.push_back({.found = "the machine runs, but is not good: " + Printable(fault),
                        .fixes = {Manual("axlecast status " + machine.file + "    # the current state"),
                                  Manual("see docs/troubleshooting.md for each fault")}});
  }
  return symptoms;
}

constexpr auto kChecks = std::to_array<Check>({
    {"multicast_route", Severity::kError, "the host has a route to LCM's multicast groups",
     "No process of the machine starts: LCM cannot send.", &CheckMulticastRoute},
    {"lcm_interface", Severity::kError, "the interface of `lcm: {interface}` exists, is up and has a carrier",
     "LCM sends and receives nothing, or does not reach other hosts. It continues as soon as the interface can be "
     "used.",
     &CheckLcmInterface},
    {"interface_choice", Severity::kWarning,
     "with a ttl above 0 and several interfaces, the machine file names one",
     "A change of the routes sends all messages by another interface, and every host with several interfaces must "
     "have "
     "the same route.",
     &CheckInterfaceChoice},
    {"loopback_multicast", Severity::kError, "the loopback interface is up and has its MULTICAST flag",
     "Messages within this host do not arrive, or only at some programs.", &CheckLoopbackMulticast},
    {"multicast_interface", Severity::kWarning, "messages with ttl=0 use lo, others use the network",
     "With ttl=0 on a network interface, all messages stop when its cable is unplugged. With ttl above 0 on lo, no "
     "other host receives messages.",
     &CheckMulticastInterface},
    {"multicast_silent", Severity::kError, "a datagram to LCM's groups comes back",
     "The processes of the machine do not receive each other's messages.", &CheckMulticastSilent},
    {"firewall", Severity::kAdvice, "no firewall may drop datagrams to LCM's ports (needs root)",
     "If a rule drops the datagrams, they are lost in the kernel without an error.", &CheckFirewall},
    {"receive_buffer_max", Severity::kWarning, "net.core.rmem_max allows the requested receive buffers",
     "If a receiver is delayed, the kernel drops messages. The recorder counts them; other programs see gaps.",
     &CheckReceiveBufferMax},
    {"receive_buffer_default", Severity::kWarning,
     "net.core.rmem_default has room for 0.1 s of the machine's messages",
     "A process that is delayed for longer on a busy host loses messages.", &CheckReceiveBufferDefault},
    {"lcm_library", Severity::kAdvice, "this host has no liblcm that forged datagrams can break",
     "axlecast's own programs do not receive through it. Other programs (lcm-logger, your own) can be crashed by "
     "any host whose datagrams reach their port, also with ttl=0.",
     &CheckLcmLibrary},
    {"other_machine", Severity::kWarning, "no other machine uses the command port",
     "axlecast's programs ignore the messages of the other machine and raise an alarm. Other programs mix up "
     "devices with equal names.",
     &CheckOtherMachine},
    {"duplicate_driver", Severity::kError, "each bus has one driver",
     "Two drivers disturb each other on the line. The alarm duplicate_driver is raised.", &CheckDuplicateDriver},
    {"machine_faults", Severity::kError, "if the machine runs, it is good by the rules of status and up",
     "Positions or commands of the named part are missing or unreliable.", &CheckMachineFaults},
});

}  // namespace

std::span<const Check> NetworkChecks() { return kChecks; }

}  // namespace axlecast
