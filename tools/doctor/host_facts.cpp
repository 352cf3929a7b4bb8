#include "tools/doctor/host_facts.h"

namespace axlecast {

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
      const bool known = !ports.empty() && ports.back().path == line.chip;  // one chip has the lines of a bus
      if (!known) ports.push_back({PortUse::Kind::kGpio, bus.name, line.chip, 0});
    }
  }
  return ports;
}

void HeardDrivers::On(const std::string& channel, std::int64_t boot_id) {
  if (IsDriverOf(machine_, channel)) {
    std::set<std::int64_t>& boots = ours_[channel];
    if (boots.size() < kMaxBoots) boots.insert(boot_id);
  } else if (others_.size() < kMaxOthers) {
    others_.emplace(channel, boot_id);
  }
}

std::vector<std::pair<std::string, std::int64_t>> HeardDrivers::All() const {
  std::vector<std::pair<std::string, std::int64_t>> all(others_.begin(), others_.end());
  for (const auto& [channel, boots] : ours_) {
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

}  // namespace axlecast
