#include "core/config/hosts.h"

#include <algorithm>
#include <iterator>

#include "core/base/spelling.h"
#include "core/config/config_map.h"
#include "core/messages/lcm_url.h"

namespace axlecast {
namespace {

std::vector<std::string> NamesOf(const std::vector<HostConfig>& hosts) {
  std::vector<std::string> names;
  names.reserve(hosts.size());
  for (const HostConfig& host : hosts) names.push_back(host.name);
  return names;
}

HostConfig LoadHost(const std::string& name, ConfigMap& map) {
  HostConfig host;
  host.name = name;
  if (!IsHostName(name)) {
    map.ErrorHere(Quoted(name) + " is no name of a host: letters, digits, '-', '_' and '.', at most 40");
  }
  if (map.Has("buses")) host.buses = map.Strings("buses");
  host.bridge = map.Bool("bridge", false);
  host.recorder = map.Bool("recorder", false);
  host.mqtt = map.Bool("mqtt", false);
  host.ship = map.Bool("ship", false);
  host.sets = map.Bool("sets", false);
  map.Done();
  return host;
}

auto CountOf(const std::vector<HostConfig>& hosts, bool HostConfig::*role) {
  return std::ranges::count_if(hosts, [role](const HostConfig& host) { return host.*role; });
}

}  // namespace

std::vector<HostConfig> LoadHosts(ConfigMap& root, const std::vector<std::string>& buses) {
  std::vector<HostConfig> hosts;
  for (auto& [name, map] : root.Maps("hosts")) {
    HostConfig host = LoadHost(name, map);
    for (const std::string& bus : host.buses) {
      if (std::ranges::find(buses, bus) == buses.end()) {
        map.Error("buses", "there is no bus " + Quoted(bus) + Suggestion(bus, buses, ""));
      }
      if (const HostConfig* other = HostOfBus(hosts, bus)) {
        map.Error("buses", Quoted(bus) + " is on host " + other->name + " already: a bus has one driver");
      }
    }
    hosts.push_back(std::move(host));
  }
  if (hosts.empty()) return hosts;
  for (const std::string& bus : buses) {
    if (HostOfBus(hosts, bus) == nullptr)
      root.Error("hosts", "bus " + Quoted(bus) + " is on no host: name it under `buses` of one");
  }
  if (CountOf(hosts, &HostConfig::bridge) != 1) root.Error("hosts", "exactly one host needs `bridge: true`");
  return hosts;
}

void CheckHosts(ConfigMap& root, const MachineConfig& machine) {
  const std::vector<HostConfig>& hosts = machine.hosts;
  if (hosts.empty()) return;
  if (!machine.recorder.logs.empty() && CountOf(hosts, &HostConfig::recorder) == 0) {
    root.Error("hosts", "`recorder` has logs, but no host has `recorder: true`");
  }
  if (!machine.mqtt.host.empty() && CountOf(hosts, &HostConfig::mqtt) != 1) {
    root.Error(
        "hosts",
        "`mqtt` has a broker: exactly one host needs `mqtt: true`, because two would publish everything twice");
  }
  if (!machine.ship.database.empty() && CountOf(hosts, &HostConfig::ship) != 1) {
    root.Error("hosts",
               "`ship` has a database: exactly one host needs `ship: true`, because a second one would take the "
               "machine over from it");
  }
  for (const HostConfig& host : hosts) {
    if (!host.ship || host.recorder) continue;
    root.Error("hosts", Quoted(host.name) + " has `ship: true` without `recorder: true`: it ships its own logs");
  }
  if (CountOf(hosts, &HostConfig::sets) > 1) {
    root.Error("hosts", "at most one host has `sets: true`, because two would publish every set twice");
  }
  const std::vector<std::string> names = NamesOf(hosts);
  if (!machine.time.root.empty() && std::ranges::find(names, machine.time.root) == names.end()) {
    root.Error("hosts", "the root of `time`, " + Quoted(machine.time.root) + ", is not one of " + Listed(names));
  }
  if (hosts.size() < 2) return;
  for (const std::string& url : {machine.lcm.url, machine.lcm.command_url}) {
    const auto parsed = ParseLcmUrl(url);
    if (parsed && (parsed->in_process || parsed->ttl == 0)) {
      root.Error("hosts", "messages do not leave a host with " + Quoted(url) +
                              ": set `lcm: {url: …?ttl=1, command_url: …?ttl=1}`");
    }
  }
}

const HostConfig* HostOfBus(const std::vector<HostConfig>& hosts, std::string_view bus) {
  const auto host = std::ranges::find_if(
      hosts, [bus](const HostConfig& each) { return std::ranges::find(each.buses, bus) != each.buses.end(); });
  return host == hosts.end() ? nullptr : &*host;
}

Result<MachineConfig> PartOn(const MachineConfig& machine, std::string_view host) {
  if (machine.hosts.empty()) return machine;
  const auto here =
      std::ranges::find_if(machine.hosts, [host](const HostConfig& each) { return each.name == host; });
  if (here == machine.hosts.end()) {
    return Failure("this host, " + Quoted(host) + ", is not under `hosts` of " + machine.file + " (" +
                   Listed(NamesOf(machine.hosts)) + "): add it, or give --host NAME");
  }
  MachineConfig part = machine;
  part.runs_bridge = here->bridge;
  if (!here->recorder) part.recorder.logs.clear();
  if (!here->mqtt) part.mqtt.host.clear();
  if (!here->ship) part.ship.database.clear();
  const bool named = CountOf(machine.hosts, &HostConfig::sets) > 0;
  if (named ? !here->sets : !here->bridge) part.sets.clear();
  std::erase_if(part.buses, [&](const BusConfig& bus) { return HostOfBus(machine.hosts, bus.name)->name != host; });
  return part;
}

}  // namespace axlecast
