#include "tools/monitor/machine_faults.h"

#include "core/messages/enum_names.h"

namespace axlecast {
namespace {

std::string InBrackets(const std::string& reason) { return reason.empty() ? "" : " (" + reason + ")"; }

void AddDevice(const DeviceView& device, MonoNs now, std::vector<std::string>& faults) {
  if (!device.info && device.readings.received() == 0) {
    faults.push_back(device.name + ": its driver was never heard");
  } else if (const auto state = device.State(now); state != device_info_t::STATE_ONLINE) {
    faults.push_back(device.name + ": " + (state ? std::string(DeviceStateName(*state)) : "SILENT") +
                     InBrackets(device.info ? device.info->reason : ""));
  }
}

void AddBus(const BusView& bus, MonoNs now, std::vector<std::string>& faults) {
  if (!bus.health) {
    faults.push_back(bus.name + ": the bus never reported");
  } else if (const auto state = bus.State(now); state != bus_health_t::STATE_UP) {
    faults.push_back(bus.name + ": " + (state ? std::string(BusStateName(*state)) : "SILENT") +
                     InBrackets(bus.health->last_error));
  }
}

}  // namespace

std::vector<std::string> MachineFaults(const MachineView& machine, MonoNs now) {
  std::vector<std::string> faults;
  for (const DeviceView& device : machine.devices()) {
    if (device.listed) AddDevice(device, now, faults);
  }
  for (const BusView& bus : machine.buses()) {
    if (bus.listed) AddBus(bus, now, faults);
  }
  if (machine.bridge().Fresh(now)) {
    for (const alarm_entry_t& alarm : machine.bridge().entries()) {
      if (alarm.severity < alarm_entry_t::SEVERITY_ERROR) continue;
      faults.push_back("bridge: " + alarm.name + ": " + alarm.action);
    }
  }
  if (machine.broker().Fresh(now)) {
    for (const alarm_entry_t& alarm : machine.broker().entries()) {
      faults.push_back("mqtt: " + alarm.name + ": " + alarm.action);
    }
  }
  return faults;
}

}  // namespace axlecast
