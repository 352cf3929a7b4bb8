#include "drivers/runtime/driver/bus_settings.h"

#include <cmath>

namespace axlecast {

BusSettings BusSettingsOf(const BusConfig& config) {
  BusSettings settings;
  if (config.poll_hz > 0) settings.schedule.period = std::llround(static_cast<double>(kSecond) / config.poll_hz);
  settings.schedule.phase = config.phase;
  if (config.devices.size() > 1) settings.schedule.pause_most = 2 * kSecond;
  settings.echo = config.link.echo;
  return settings;
}

}  // namespace axlecast
