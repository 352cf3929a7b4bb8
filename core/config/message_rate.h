#pragma once

#include "core/config/machine_config.h"

namespace axlecast {

// POSITION or MOTOR messages a second of a device of the bus: at most publish_hz, and no more often than it is read.
[[nodiscard]] double MessageRate(const BusConfig& bus, const DeviceConfig& device);
// Of all devices.
[[nodiscard]] double MessageRate(const MachineConfig& machine);

}  // namespace axlecast
