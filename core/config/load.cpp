#include "core/config/load.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "core/base/spelling.h"
#include "core/config/abbreviations.h"
#include "core/config/hosts.h"
#include "core/config/service_config.h"
#include "core/config/sets.h"
#include "core/config/yaml_text.h"
#include "core/messages/lcm_url.h"

namespace axlecast {
namespace {

constexpr std::size_t kLongestPrefix = 16;  // LCM's channel names end at 63 characters
constexpr double kMaxPolled = 20'000;       // T-format's wire limit is 19.6 kHz
// The longest delay of a reply that a busy computer or a USB adapter was seen to add stays well below this.
constexpr MonoNs kUsualLate = 500 * kMillisecond;
constexpr std::int64_t kLateTimeouts = 12;
constexpr std::int64_t kMaxLateUs = 100'000'000;
constexpr std::string_view kBridgeName = "bridge";  // of ALARM/bridge

bool ConsistsOf(std::string_view text, std::string_view characters) {
  return text.find_first_not_of(characters) == std::string_view::npos;
}

std::string Hertz(double hz) {
  std::ostringstream text;
  text << std::floor(hz * 10) / 10 << " Hz";
  return text.str();
}

class MachineLoader {
 public:
  MachineLoader(ConfigErrors& errors, std::string_view only_bus) : errors_(errors), only_bus_(only_bus) {}

  MachineConfig Load(const YAML::Node& document) {
    ConfigMap root(document, "", errors_);
    machine_.machine = root.RequiredString("machine");
    if (root.Has("machine") && !IsName(machine_.machine)) {
      root.Error("machine", Quoted(machine_.machine) + kNameRule);
    }
    LoadLcm(root.Map("lcm"));
    root.MarkRequired("buses");
    auto buses = root.Maps("buses");
    if (buses.empty()) root.Error("buses", "is missing or empty: a machine needs at least one bus");
    std::vector<std::string> bus_names;
    bus_names.reserve(buses.size());
    for (const auto& [name, map] : buses) bus_names.push_back(name);
    machine_.hosts = LoadHosts(root, bus_names);
    for (auto& [name, map] : buses) LoadBus(name, map);
    if (!only_bus_.empty() && !seen_only_bus_) root.Error("buses", "there is no bus " + Quoted(only_bus_));
    machine_.bridge = LoadBridge(root.Map("bridge"), families_);
    machine_.recorder = LoadRecorder(root.Map("recorder"));
    machine_.web = LoadWeb(root.Map("web"));
    machine_.mqtt = LoadMqtt(root.Map("mqtt"), DeviceNames());
    machine_.ship = LoadShip(root.Map("ship"));
    if (!machine_.ship.database.empty() && machine_.recorder.logs.empty()) {
      root.Error("ship", "sends the logs of the recorder to a database: name at least one log below `recorder`");
    }
    machine_.time = LoadTime(root.Map("time"));
    if (only_bus_.empty()) {
      machine_.sets = LoadSets(root, machine_);
    } else {
      static_cast<void>(root.Has("sets"));  // their axes are on other buses too
    }
    CheckHosts(root, machine_);
    for (const char* replaced : {"include", "defaults"}) static_cast<void>(root.Has(replaced));  // known, but gone
    root.Done();
    return std::move(machine_);
  }

 private:
  [[nodiscard]] std::vector<std::string> DeviceNames() const {
    std::vector<std::string> names;
    for (const auto& [name, bus] : devices_) names.push_back(name);
    return names;
  }

  void LoadLcm(ConfigMap map) {
    LcmConfig& lcm = machine_.lcm;
    lcm.url = map.String("url", lcm.url);
    lcm.command_url = map.String("command_url", lcm.command_url);
    lcm.prefix = map.String("prefix", "");
    AddInterface(map, lcm);
    const auto data = ParseLcmUrl(lcm.url);
    const auto command = ParseLcmUrl(lcm.command_url);
    if (!data) map.Error("url", Quoted(lcm.url) + ' ' + data.error().text);
    if (!command) map.Error("command_url", Quoted(lcm.command_url) + ' ' + command.error().text);
    if (data && command && !data->in_process && data->port == command->port) {
      map.Error("command_url", Quoted(lcm.command_url) +
                                   " has the port of lcm.url: commands need their own port, because LCM hands "
                                   "every process all of a port's messages");
    }
    if (lcm.prefix.size() > kLongestPrefix ||
        !ConsistsOf(lcm.prefix, "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./")) {
      map.Error("prefix", Quoted(lcm.prefix) + " is no prefix: at most 16 of letters, digits, _ - . and /");
    }
    map.Done();
  }

  // The URLs carry the interface to every process.
  static void AddInterface(ConfigMap& map, LcmConfig& lcm) {
    if (!map.Has("interface")) return;
    const std::string interface = map.String("interface", "");
    if (!IsInterface(interface)) return map.Error("interface", Quoted(interface) + kInterfaceRule);
    for (std::string* url : {&lcm.url, &lcm.command_url}) {
      if (*url == "memq://") map.Error("interface", "has no meaning with memq://, which uses no network");
      *url = WithInterface(*url, interface);
    }
  }

  void LoadBus(const std::string& name, ConfigMap& map) {
    map.CheckName(name);
    map.MarkRequired("devices");
    auto devices = map.Maps("devices");
    for (auto& [device, device_map] : devices) {
      device_map.CheckName(device);
      if (device == kBridgeName) {
        device_map.ErrorHere("'bridge' is the bridge's own name (ALARM/bridge): give the device another one");
      }
      const auto [first, added] = devices_.emplace(device, name);
      if (!added && first->second != name) {
        device_map.ErrorHere("the name is taken by a device of bus " + first->second +
                             ": a device's name is its channel, one for the whole machine");
      }
      families_.emplace(device, nullptr);
    }
    if (!only_bus_.empty() && name != only_bus_) return;
    seen_only_bus_ = true;

    BusConfig bus;
    bus.name = name;
    bus.family = LoadFamily(map);
    if (bus.family == nullptr) return;  // what its keys mean is unknown
    for (auto& [device, device_map] : devices) families_[device] = bus.family;
    LoadTiming(map, bus);
    bus.simulate = LoadSimulate(map);
    bus.link = LoadLink(map.Map("link"), *bus.family, bus.simulate, RunDirectory(machine_.machine) + '/' + name);
    RegisterLink(map.Map("link"), bus);
    if (bus.family->parse_bus != nullptr) bus.family_bus = bus.family->parse_bus(map, bus);
    bus.capture = map.Bool("capture", false);
    LoadRealtime(map.Map("realtime"), bus.realtime);
    CheckNumberOfDevices(map, *bus.family, devices);
    for (auto& [device, device_map] : devices) bus.devices.push_back(LoadDevice(device, device_map, bus));
    LoadLate(map, bus);
    if (bus.family->check_bus != nullptr) bus.family->check_bus(map, bus);
    CheckRate(map, bus);
    map.Done();
    machine_.buses.push_back(std::move(bus));
  }

  static const Family* LoadFamily(ConfigMap& map) {
    std::vector<std::string> known;
    for (const Family* family : Families()) known.emplace_back(family->name);
    if (!map.Require("family", "one of " + Listed(known))) return nullptr;
    const std::string name = map.String("family", "");
    const Family* family = FindFamily(name);
    if (family == nullptr && !name.empty()) {
      map.Error("family", Quoted(name) + " is not one of " + Listed(known) + Suggestion(name, known, ""));
    }
    return family;
  }

  static void LoadTiming(ConfigMap& map, BusConfig& bus) {
    bus.poll_hz =
        map.Number("poll_hz", bus.family->default_poll_hz, 0, kMaxPolled, "Hz (0: as fast as the bus allows)");
    if (!map.Has("phase_us")) return;
    if (bus.poll_hz <= 0) {
      map.Error("phase_us", "has no meaning without slots: set poll_hz");
      return;
    }
    const double period_us = 1e6 / bus.poll_hz;
    bus.phase = std::llround(map.Number("phase_us", 0, 0, period_us, "us (one period of poll_hz)") * 1e3);
  }

  static void LoadLate(ConfigMap& map, BusConfig& bus) {
    MonoNs timeout = 0;
    for (const DeviceConfig& device : bus.devices) timeout = std::max(timeout, device.settings->reply_timeout);
    if (timeout == 0) {
      if (map.Has("late_us")) map.Error("late_us", "has no meaning here: no reply of this bus can come late");
      return;
    }
    const std::int64_t usual = std::min(std::max(kUsualLate, kLateTimeouts * timeout) / kMicrosecond, kMaxLateUs);
    bus.late = map.Integer("late_us", usual, 2 * timeout / kMicrosecond, kMaxLateUs,
                           "us, at least twice timeout_us, of a stream latency_us") *
               kMicrosecond;
  }

  static bool LoadSimulate(ConfigMap& map) {
    if (!map.Has("simulate")) return false;
    const YAML::Node node = map.node();
    // The keys of a mapping are the family's; MakeSimulator checks them.
    return node["simulate"].IsMap() || map.Bool("simulate", false);
  }

  // No two buses of a host share a line.
  void RegisterLink(ConfigMap map, const BusConfig& bus) {
    if (bus.simulate || bus.link.port.empty()) return;
    const std::string key = LinkKey(bus.family->link);
    const HostConfig* host = HostOfBus(machine_.hosts, bus.name);
    const std::string place = host == nullptr ? "" : host->name;
    const auto [first, added] = ports_.emplace(std::pair(place, bus.link.port), bus.name);
    if (added) return;
    map.Error(key, Quoted(bus.link.port) + " is used already by bus " + first->second + ": each bus has a " + key +
                       " of its own");
  }

  static void LoadRealtime(ConfigMap map, RealtimeConfig& realtime) {
    realtime.priority = static_cast<int>(map.Integer("priority", 0, 0, 99, "(SCHED_FIFO; 0: normal scheduling)"));
    realtime.cpu = static_cast<int>(map.Integer("cpu", -1, -1, 1023, "(-1: any)"));
    realtime.lock_memory = map.Bool("lock_memory", false);
    map.Done();
  }

  static void CheckNumberOfDevices(ConfigMap& map, const Family& family,
                                   const std::vector<std::pair<std::string, ConfigMap>>& devices) {
    const std::size_t maximum = family.max_devices_per_bus;
    const std::string name(family.name);
    if (devices.empty()) {
      map.Error("devices", "is missing or empty: name at least one device");
    } else if (devices.size() > maximum && maximum == 1) {
      map.Error("devices", std::to_string(devices.size()) + " devices, but " + name +
                               " is point to point (its protocol has no addresses): one device per bus; give " +
                               Quoted(devices[1].first) + " a bus of its own");
    } else if (devices.size() > maximum) {
      map.Error("devices", std::to_string(devices.size()) + " devices, but a bus of " + name + " holds at most " +
                               std::to_string(maximum) + ": split the bus");
    }
  }

  static void CheckRate(ConfigMap& map, const BusConfig& bus) {
    const MonoNs round = RoundTime(bus);
    if (bus.poll_hz <= 0 || round <= 0) return;
    const double possible = static_cast<double>(kSecond) / static_cast<double>(round);
    if (bus.poll_hz <= possible) return;
    map.Error("poll_hz", Hertz(bus.poll_hz) + " is more than the wire carries: one round takes " +
                             std::to_string(round / kMicrosecond) + " us; at most " + Hertz(possible) + ", or 0" +
                             (bus.devices.size() > 1 ? ", or split the bus" : ""));
  }

  ConfigErrors& errors_;
  std::string_view only_bus_;
  bool seen_only_bus_ = false;
  MachineConfig machine_;
  std::map<std::string, std::string> devices_;                        // name -> bus
  std::map<std::pair<std::string, std::string>, std::string> ports_;  // host, and path or interface -> bus
  DeviceFamilies families_;
};

}  // namespace

namespace {

std::optional<MachineConfig> LoadDocument(MachineDocument document, ConfigErrors& errors,
                                          std::string_view only_bus) {
  if (!document.root.IsDefined()) return std::nullopt;
  MachineConfig machine = MachineLoader(errors, only_bus).Load(ExpandAbbreviations(document.root, errors));
  if (!errors.empty()) return std::nullopt;
  machine.text = std::move(document.text);
  machine.sources = std::move(document.sources);
  return machine;
}

}  // namespace

std::optional<MachineConfig> ParseConfig(const std::string& text, ConfigErrors& errors, std::string_view only_bus) {
  return LoadDocument(ParseMachineText(text, errors), errors, only_bus);
}

std::optional<MachineConfig> LoadConfigFrom(const std::string& file, const ConfigReader& read, ConfigErrors& errors,
                                            std::string_view only_bus) {
  std::optional<MachineConfig> machine = LoadDocument(ReadMachineFile(file, read, errors), errors, only_bus);
  if (machine) machine->file = file;
  return machine;
}

std::optional<MachineConfig> LoadConfig(const std::string& file, ConfigErrors& errors, std::string_view only_bus,
                                        ConfigWriters writers) {
  return LoadConfigFrom(
      file, [writers](const std::string& path) { return ReadConfigFile(path, writers); }, errors, only_bus);
}

SimulatorMaker::SimulatorMaker(const MachineConfig& machine, ConfigErrors& errors) : errors_(&errors) {
  const MachineDocument document = ReadAgain(machine, errors);
  if (!document.root.IsDefined()) return;
  ConfigMap root(ExpandAbbreviations(document.root, errors), "", errors);
  for (auto& [name, map] : root.Maps("buses")) buses_.emplace(name, map);
}

std::unique_ptr<Simulator> SimulatorMaker::Make(const BusConfig& bus) {
  const auto found = buses_.find(bus.name);
  if (found == buses_.end()) return nullptr;
  ConfigMap& map = found->second;
  const YAML::Node node = map.node();
  const bool has_keys = node.IsMap() && node["simulate"].IsDefined() && node["simulate"].IsMap();
  ConfigMap keys = has_keys ? map.Map("simulate") : map.Empty("simulate");
  std::unique_ptr<Simulator> simulator = bus.family->make_simulator(bus, keys);
  keys.Done();
  return errors_->empty() ? std::move(simulator) : nullptr;
}

}  // namespace axlecast
