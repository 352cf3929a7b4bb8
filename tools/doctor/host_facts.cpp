#include "tools/doctor/host_facts.h"

#include <grp.h>
#include <poll.h>
#include <unistd.h>
#include <axlecast/driver_status_t.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <system_error>

#include "core/base/result.h"
#include "core/config/config_file.h"
#include "core/messages/lcm_url.h"
#include "core/messages/message.h"
#include "platform/net/chrony_port.h"
#include "platform/net/group_check.h"
#include "platform/net/lcm_port.h"
#include "platform/os/system_clock.h"
#include "tools/monitor/live_machine.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {
namespace {

void ReadGroups(const MachineConfig& machine, NetworkFacts& network) {
  for (const std::string& text : {machine.lcm.url, machine.lcm.command_url}) {
    const auto url = ParseLcmUrl(text);
    if (!url || url->in_process) continue;
    GroupFacts facts;
    if (url->interface.empty()) {
      facts.route = FindMulticastRoute(url->group);
    } else {
      facts.interface_problem = InterfaceWatch(*url).problem();
      if (const auto found = FindInterface(url->interface)) facts.route.interface = found->name;
    }
    if (facts.route.error == 0) facts.silence = ErrorText(CheckMulticast(text));
    network.groups.emplace(text, std::move(facts));
  }
  network.interfaces = Interfaces();
}

// Asks the kernel, and chronyd, which answers within 1 ms.
ClockFacts ReadClock() {
  const KernelUtc kernel = ReadKernelUtc();
  ClockFacts facts{.known = kernel.known, .synchronised = kernel.synchronised, .chrony = {}, .utc_ns = 0};
  ChronyPort port;
  port.Ask();
  const SystemClock clock;
  std::array<pollfd, 1> files = {{{port.FileDescriptor(), POLLIN, 0}}};
  if (PollUntil(files, clock.Now() + 200 * kMillisecond, clock) > 0) facts.chrony = port.Receive();
  facts.utc_ns = clock.UtcMicroseconds() * kMicrosecond;
  return facts;
}

// Receives the status of drivers, also of other machines.
void ReceiveDrivers(const MachineConfig& machine, MonoNs listen, NetworkFacts& network) {
  const auto group = network.groups.find(machine.lcm.command_url);
  if (listen <= 0 || group == network.groups.end() || group->second.route.error != 0) return;
  if (!group->second.silence.empty()) return;
  LcmPort port(machine.lcm.command_url, "");
  if (!port.problem().empty()) return;
  ReceivedDrivers drivers(machine);
  MachineFilter machines(machine.machine);
  const SystemClock clock;
  const auto receive = [&](const std::string& channel, Bytes message) {
    const auto status = DecodeMessage<driver_status_t>(message);
    if (!status) return;
    if (machines.Takes(message)) return drivers.On(channel, status->boot_id);
    if (channel.starts_with(machine.lcm.prefix + "DRIVER_STATUS/")) machines.Refuse(message, clock.Now());
  };
  if (!port.Subscribe(".*DRIVER_STATUS/.*", receive)) return;
  for (const MonoNs end = clock.Now() + listen; clock.Now() < end;) {
    const MonoNs left = (end - clock.Now()) / kMillisecond + 1;
    if (!port.Handle(static_cast<int>(left))) break;
  }
  network.drivers = drivers.All();
  network.machines = machines.Others(clock.Now());
}

// Receives the messages of the machine if one of its drivers runs, and finds their faults.
void ReceiveMachine(const MachineConfig& machine, NetworkFacts& network) {
  const auto ours = [&machine](const auto& driver) { return IsDriverOf(machine, driver.first); };
  const auto group = network.groups.find(machine.lcm.url);
  if (std::ranges::none_of(network.drivers, ours)) return;
  if (group == network.groups.end() || group->second.route.error != 0 || !group->second.silence.empty()) return;
  const SystemClock clock;
  LiveMachine live(machine, clock);
  if (live.GatherAll(machine) && !live.view().NothingReceived()) {
    network.machine_faults = MachineFaults(live.view(), clock.Now());
  }
}

// Accepts liblcm.so.1.3.4, but not the links to it.
bool IsLcmLibrary(const std::string& name) {
  return name.starts_with("liblcm.so.") && std::count(name.begin(), name.end(), '.') > 2;
}

std::vector<std::string> FindLcmLibraries(const HostFiles& files) {
  std::vector<std::string> folders = {"/usr/local/lib", "/usr/lib"};
  for (const std::string& name : files.Names("/usr/lib")) {
    if (name.ends_with("-linux-gnu")) folders.push_back("/usr/lib/" + name);
  }
  std::vector<std::string> found;
  for (const std::string& folder : folders) {
    for (const std::string& name : files.Names(folder)) {
      if (IsLcmLibrary(name)) found.push_back(folder + '/' + name);
    }
  }
  return found;
}

NetworkFacts ReadNetwork(const MachineConfig& machine, const ReadHostOptions& options) {
  NetworkFacts network;
  ReadGroups(machine, network);
  network.loopback = ReadLoopback();
  if (geteuid() == 0) network.firewall = RunProgram("nft --json list ruleset 2>/dev/null").value_or("");
  network.receive_max = options.files.Number("/proc/sys/net/core/rmem_max");
  network.receive_default = options.files.Number("/proc/sys/net/core/rmem_default");
  network.lcm_libraries = FindLcmLibraries(options.files);
  if (!machine.buses.empty()) ReceiveDrivers(machine, options.listen, network);
  if (options.read_machine) ReceiveMachine(machine, network);
  return network;
}

// Returns a link in `folder` to the device; empty without such a link.
std::string LinkTo(const HostFiles& files, const std::string& folder, const HostFile& device) {
  for (const std::string& name : files.Names(folder)) {
    const HostFile file = files.Look(folder + '/' + name);
    if (file.kind == device.kind && file.major == device.major && file.minor == device.minor) return file.path;
  }
  return "";
}

PortFacts ReadPort(const HostFiles& files, const PortUse& use) {
  PortFacts port;
  port.file = files.Look(use.path);
  if (port.file.kind != HostFile::Kind::kCharacter) return port;
  port.holders = files.Holders(use.path);
  if (use.kind != PortUse::Kind::kSerial) return port;
  for (const char* folder : {"/dev/serial/by-id", "/dev/serial/by-path"}) {
    if (port.lasting_name.empty()) port.lasting_name = LinkTo(files, folder, port.file);
  }
  const std::string sysfs = files.Place("/sys");
  const TtyFacts tty = ReadTtyFacts(sysfs, port.file.major, port.file.minor);
  port.usb = tty.usb;
  if (tty.latency_timer.empty()) return port;
  std::error_code error;
  const std::string real = std::filesystem::canonical(sysfs, error).string();
  port.latency_timer = "/sys" + tty.latency_timer.substr(real.size());
  port.latency_ms = files.Number(port.latency_timer);
  return port;
}

ProcessorFacts ReadProcessors(const HostFiles& files) {
  const std::string folder = "/sys/devices/system/cpu";
  ProcessorFacts processors;
  processors.online = files.Text(folder + "/online").value_or("");
  for (const std::string& name : files.Names(folder)) {
    const std::string path = folder + '/' + name + "/cpufreq/scaling_governor";
    if (const auto governor = files.Text(path)) processors.governors.emplace_back(path, *governor);
  }
  processors.clock_source =
      files.Text("/sys/devices/system/clocksource/clocksource0/current_clocksource").value_or("");
  return processors;
}

// Returns the size of the files <machine>-<log>_<time>.lcm; `begin` is the name up to the time.
std::int64_t BytesOfLog(const std::string& folder, const std::string& begin) {
  std::int64_t bytes = 0;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (!entry.path().filename().string().starts_with(begin)) continue;
    const auto size = entry.file_size(error);
    if (!error) bytes += static_cast<std::int64_t>(size);
  }
  return bytes;
}

void ReadDisks(const MachineConfig& machine, HostFacts& host) {
  host.journal = LookAtFolder(std::filesystem::path(JournalFile(machine)).parent_path().string());
  if (machine.recorder.logs.empty()) return;
  const std::string folder = LogDirectory(machine);
  host.logs = LookAtFolder(folder);
  for (const LogConfig& log : machine.recorder.logs) {
    host.log_bytes[log.name] = BytesOfLog(folder, machine.machine + '-' + log.name + '_');
  }
}

std::map<std::string, std::vector<std::string>> ReadGroups(const HostFiles& files) {
  std::map<std::string, std::vector<std::string>> groups;
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(files.Place("/etc/group").c_str(), "re"),
                                                   &std::fclose);
  while (const ::group* const entry = file ? fgetgrent(file.get()) : nullptr) {
    std::vector<std::string>& members = groups[entry->gr_name];
    for (char** member = entry->gr_mem; *member != nullptr; ++member) members.emplace_back(*member);
  }
  return groups;
}

}  // namespace

std::string ModeText(const HostFile& file) {
  std::string text;
  for (const unsigned shift : {9U, 6U, 3U, 0U}) text += static_cast<char>('0' + (file.mode >> shift & 7U));
  return text;
}

std::vector<PortUse> PortsOf(const MachineConfig& machine) {
  std::vector<PortUse> ports;
  for (const BusConfig& bus : machine.buses) {
    if (bus.simulate) continue;
    const LinkKind link = bus.family->link;
    if (link == LinkKind::kSpi) ports.push_back({PortUse::Kind::kSpi, bus.name, bus.link.port, 0});
    if (link == LinkKind::kSerial || link == LinkKind::kModbus) {
      ports.push_back({PortUse::Kind::kSerial, bus.name, bus.link.port, bus.link.line.baud});
    }
    if (!bus.family_bus) continue;
    for (const PulseLineConfig& line : bus.family_bus->lines) {
      const bool known = !ports.empty() && ports.back().path == line.chip;  // the lines of a bus are on one chip
      if (!known) ports.push_back({PortUse::Kind::kGpio, bus.name, line.chip, 0});
    }
  }
  return ports;
}

void ReceivedDrivers::On(const std::string& channel, std::int64_t boot_id) {
  if (IsDriverOf(machine_, channel)) {
    std::set<std::int64_t>& boots = own_[channel];
    if (boots.size() < kMaxBoots) boots.insert(boot_id);
  } else if (others_.size() < kMaxOthers) {
    others_.emplace(channel, boot_id);
  }
}

std::vector<std::pair<std::string, std::int64_t>> ReceivedDrivers::All() const {
  std::vector<std::pair<std::string, std::int64_t>> all(others_.begin(), others_.end());
  for (const auto& [channel, boots] : own_) {
    for (const std::int64_t boot_id : boots) all.emplace_back(channel, boot_id);
  }
  return all;
}

std::string BusOfChannel(const std::string& channel) { return channel.substr(channel.rfind('/') + 1); }

bool IsDriverOf(const MachineConfig& machine, const std::string& channel) {
  return channel.starts_with(machine.lcm.prefix + "DRIVER_STATUS/") &&
         machine.FindBus(BusOfChannel(channel)) != nullptr;
}

std::vector<const BusConfig*> CanBusesOf(const MachineConfig& machine) {
  std::vector<const BusConfig*> buses;
  for (const BusConfig& bus : machine.buses) {
    if (!bus.simulate && bus.family->link == LinkKind::kCan) buses.push_back(&bus);
  }
  return buses;
}

std::vector<std::string> OwnKeyFiles(const MachineConfig& machine) {
  std::vector<std::string> files;
  for (const OwnKey* key : {&machine.bridge.bridge, &machine.bridge.drivers}) {
    if (!key->place.file.empty()) files.push_back(key->place.file);
  }
  return files;
}

std::vector<std::string> GrantKeyFiles(const MachineConfig& machine) {
  std::vector<std::string> files;
  for (const KeyGrant& grant : machine.bridge.keys) {
    if (!grant.place.file.empty()) files.push_back(grant.place.file);
  }
  return files;
}

bool RunsUnderAccounts(const MachineConfig& machine, const HostFacts& host) {
  return host.groups.contains(kDriversAccount) && machine.file.starts_with("/etc/axlecast/");
}

HostFacts ReadHost(const MachineConfig& machine, const ReadHostOptions& options) {
  const HostFiles& files = options.files;
  HostFacts host;
  host.user = geteuid();
  host.processes = files.Processes();
  host.network = ReadNetwork(machine, options);
  for (const PortUse& use : PortsOf(machine)) host.ports.emplace(use.path, ReadPort(files, use));
  host.spi_buffer = files.Number("/sys/module/spidev/parameters/bufsiz");
  CanNetlink netlink;
  if (netlink.Open()) {
    for (const BusConfig* bus : CanBusesOf(machine)) host.can.emplace(bus->link.port, netlink.Ask(bus->link.port));
  }
  for (const BusConfig* bus : CanBusesOf(machine)) {
    const std::string& name = bus->link.port;
    if (const auto queue = files.Number("/sys/class/net/" + name + "/tx_queue_len")) host.can_queues[name] = *queue;
  }
  host.limits = ReadRealtimeLimits();
  host.processors = ReadProcessors(files);
  host.clock = ReadClock();
  host.groups = ReadGroups(files);
  if (machine.file.empty()) return host;
  ReadDisks(machine, host);
  const HostFiles own;
  for (const auto& paths : {OwnKeyFiles(machine), GrantKeyFiles(machine)}) {
    for (const std::string& path : paths) host.secrets.emplace(path, own.Look(path));
  }
  std::vector<std::string> configs = {machine.file};
  for (std::size_t i = 1; i < machine.sources.size(); ++i) configs.push_back(machine.sources[i].file);
  for (const std::string& file : configs) host.configs.push_back({own.Look(file), OthersMayWriteConfig(file)});
  return host;
}

}  // namespace axlecast
