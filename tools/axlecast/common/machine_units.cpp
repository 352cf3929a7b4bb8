#include "tools/axlecast/common/machine_units.h"

#include <algorithm>

namespace axlecast {

std::vector<std::string> MachineUnits(const MachineConfig& machine) {
  std::vector<std::string> units = {"axlecast-bridge.service"};
  if (!machine.recorder.logs.empty()) units.emplace_back("axlecast-record.service");
  if (std::any_of(machine.buses.begin(), machine.buses.end(), [](const BusConfig& bus) { return bus.simulate; })) {
    units.emplace_back("axlecast-simulate.service");
  }
  for (const BusConfig& bus : machine.buses) units.push_back("axlecast-driver@" + bus.name + ".service");
  return units;
}

std::vector<std::string> MachineNames(const MachineConfig& machine, bool devices) {
  std::vector<std::string> names;
  for (const BusConfig& bus : machine.buses) {
    if (!devices) names.push_back(bus.name);
    for (const DeviceConfig& device : bus.devices) {
      if (devices) names.push_back(device.name);
    }
  }
  return names;
}

}  // namespace axlecast
