#pragma once

#include <cstdint>

#include "core/base/time.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The instants at which the devices of a bus are read: tick k is at phase + k x period of the time base of the machine, or without
// one of CLOCK_MONOTONIC of the host.
struct Ticks {
  MonoNs period = 0;  // 0: there are none
  MonoNs phase = 0;
  MonoNs lead = 0;  // requests begin this much before the tick, so that the device samples on it
};

// The number of a reading that was requested on no tick, or on one that is not known.
inline constexpr std::int64_t kNoTick = -1;

// Returns the ticks of a bus. The lead is that of its first device, and 0 on a simulated line, on which a request takes no time.
[[nodiscard]] Ticks TicksOf(const BusConfig& bus);

// Returns true if the readings of the device are requested on ticks; false if it is no encoder, sends by itself, or is read as fast as
// the bus allows.
[[nodiscard]] bool IsReadOnTicks(const BusConfig& bus, const DeviceConfig& device);

// Returns the number of ticks from one POSITION message of the device to the next; 0 if it is no whole number, or the device is not read
// on ticks.
[[nodiscard]] std::int64_t TicksPerMessage(const BusConfig& bus, const DeviceConfig& device);

}  // namespace axlecast
