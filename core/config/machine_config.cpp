#include "core/config/machine_config.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>

namespace axlecast {
namespace {

std::string Environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

const DeviceConfig* FindIn(const BusConfig& bus, std::string_view name) {
  const auto found = std::find_if(bus.devices.begin(), bus.devices.end(),
                                  [name](const DeviceConfig& device) { return device.name == name; });
  return found == bus.devices.end() ? nullptr : &*found;
}

}  // namespace

const BusConfig* MachineConfig::FindBus(std::string_view name) const {
  for (const BusConfig& bus : buses) {
    if (bus.name == name) return &bus;
  }
  return nullptr;
}

const BusConfig* MachineConfig::BusOf(std::string_view device) const {
  for (const BusConfig& bus : buses) {
    if (FindIn(bus, device) != nullptr) return &bus;
  }
  return nullptr;
}

const DeviceConfig* MachineConfig::FindDevice(std::string_view name) const {
  for (const BusConfig& bus : buses) {
    if (const DeviceConfig* device = FindIn(bus, name)) return device;
  }
  return nullptr;
}

MonoNs RoundTime(const BusConfig& bus) {
  MonoNs time = 0;
  for (const DeviceConfig& device : bus.devices) {
    if (device.settings) time += device.settings->wire_time;
  }
  return time;
}

SpiSettings SpiOf(const BusConfig& bus) {
  return bus.devices.empty() ? SpiSettings{} : bus.devices.front().settings->spi;
}

CanFilters CanFiltersOf(const BusConfig& bus) {
  CanFilters filters;
  for (const DeviceConfig& device : bus.devices) {
    filters.insert(filters.end(), device.settings->can_filters.begin(), device.settings->can_filters.end());
  }
  return filters;
}

std::string RunDirectory(const std::string& machine) {
  std::string base = Environment("AXLECAST_RUN_DIR");
  if (base.empty()) {
    const std::string runtime = Environment("XDG_RUNTIME_DIR");
    base = runtime.empty() ? "/tmp/axlecast-" + std::to_string(getuid()) : runtime + "/axlecast";
  }
  return base + '/' + machine;
}

std::string StateDirectory(const std::string& machine) {
  std::string base = Environment("STATE_DIRECTORY");
  if (base.empty()) {
    const std::string state = Environment("XDG_STATE_HOME");
    base = (state.empty() ? Environment("HOME") + "/.local/state" : state) + "/axlecast";
  }
  return base + '/' + machine;
}

std::string JournalFile(const MachineConfig& machine) {
  return machine.bridge.journal.empty() ? StateDirectory(machine.machine) + "/journal.db" : machine.bridge.journal;
}

std::string LogDirectory(const MachineConfig& machine) {
  if (!machine.recorder.directory.empty()) return machine.recorder.directory;
  const std::string logs = Environment("LOGS_DIRECTORY");
  return logs.empty() ? StateDirectory(machine.machine) + "/log" : logs + '/' + machine.machine;
}

const KeyGrant* BridgeConfig::FindKey(std::int64_t id) const {
  const auto found = std::find_if(keys.begin(), keys.end(), [id](const KeyGrant& grant) { return grant.id == id; });
  return found == keys.end() ? nullptr : &*found;
}

double UnitPerCount(const DeviceConfig& device) {
  return device.per_turn * static_cast<double>(device.ratio_num) /
         (static_cast<double>(device.ratio_den) * static_cast<double>(device.settings->counts_per_turn));
}

double MessageRate(const BusConfig& bus, const DeviceConfig& device) {
  constexpr auto kPerSecond = static_cast<double>(kSecond);
  // As it sends by itself, as it is asked, or as fast as the bus allows.
  auto period = static_cast<double>(device.settings->own_period);
  if (period <= 0) period = bus.poll_hz > 0 ? kPerSecond / bus.poll_hz : static_cast<double>(RoundTime(bus));
  return period > 0 ? std::min(device.publish_hz, kPerSecond / period) : device.publish_hz;
}

double MessageRate(const MachineConfig& machine) {
  double sum = 0;
  for (const BusConfig& bus : machine.buses) {
    for (const DeviceConfig& device : bus.devices) sum += MessageRate(bus, device);
  }
  return sum;
}

}  // namespace axlecast
