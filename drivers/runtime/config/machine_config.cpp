#include "drivers/runtime/config/machine_config.h"

#include <unistd.h>

#include <cstdlib>

namespace axlecast {
namespace {

std::string Environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
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
    for (const DeviceConfig& candidate : bus.devices) {
      if (candidate.name == device) return &bus;
    }
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

}  // namespace axlecast
