#include "core/config/ticks.h"

#include <cmath>

namespace axlecast {

Ticks TicksOf(const BusConfig& bus) {
  Ticks ticks;
  if (bus.poll_hz <= 0) return ticks;
  ticks.period = std::llround(static_cast<double>(kSecond) / bus.poll_hz);
  ticks.phase = bus.phase;
  if (!bus.simulate && !bus.devices.empty()) ticks.lead = bus.devices.front().settings->latch_after;
  return ticks;
}

bool IsReadOnTicks(const BusConfig& bus, const DeviceConfig& device) {
  if (bus.family == nullptr || !bus.family->has_position) return false;
  return bus.poll_hz > 0 && device.settings->own_period == 0;
}

std::int64_t TicksPerMessage(const BusConfig& bus, const DeviceConfig& device) {
  constexpr double kWhole = 1e-9;  // relative; rates are decimal fractions
  if (!IsReadOnTicks(bus, device) || device.publish_hz <= 0) return 0;
  const double ratio = bus.poll_hz / device.publish_hz;
  const double whole = std::round(ratio);
  return std::abs(ratio - whole) <= kWhole * ratio ? static_cast<std::int64_t>(whole) : 0;
}

}  // namespace axlecast
