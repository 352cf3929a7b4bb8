#include "drivers/runtime/process/bus_settings.h"

#include <algorithm>
#include <cmath>

namespace axlecast {

namespace {

// A silent device costs the others at most 1/33 of the bus, and less than twice that with the silence that follows.
constexpr int kPauseCosts = 32;

}  // namespace

WireLog::Kind WireKindOf(const BusConfig& config) {
  switch (config.family->link) {
    case LinkKind::kCan:
      return {.kind = wire_t::KIND_CAN, .clock_hz = 0};
    case LinkKind::kSpi:
      return {.kind = wire_t::KIND_SPI, .clock_hz = static_cast<std::int32_t>(SpiOf(config).clock_hz)};
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      return {};
  }
  return {};
}

BusSettings BusSettingsOf(const BusConfig& config, PulseLines* lines) {
  BusSettings settings;
  if (config.poll_hz > 0) settings.schedule.period = std::llround(static_cast<double>(kSecond) / config.poll_hz);
  settings.schedule.phase = config.phase;
  if (config.devices.size() > 1) {
    settings.schedule.pause_most_shared = 2 * kSecond;
    settings.schedule.pause_costs = kPauseCosts;
  }
  if (config.family_bus) settings.schedule.pacing = config.family_bus->pacing;
  settings.schedule.line = config.link.line;
  settings.echo = config.link.echo;
  settings.late = config.late;
  if (!config.simulate) settings.wire = config.link.line;
  settings.lines = lines;
  return settings;
}

bool HoldsSecrets(const BusConfig& config) {
  return std::any_of(config.devices.begin(), config.devices.end(),
                     [](const DeviceConfig& device) { return device.settings && device.settings->holds_secrets; });
}

}  // namespace axlecast
