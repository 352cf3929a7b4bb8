#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// Serial ports, SPI devices and GPIO chips of the machine's file.
[[nodiscard]] Symptoms CheckPortMissing(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckPortPermission(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckPortHeld(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckPortName(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckPortProber(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckUsbLatency(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckAdapterRate(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckSpiBuffer(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
