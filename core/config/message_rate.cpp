#include "core/config/message_rate.h"

#include <algorithm>

namespace axlecast {

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
