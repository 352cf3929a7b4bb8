#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// Serial ports, SPI devices and GPIO chips of the machine's file.
[[nodiscard]] Findings CheckPortMissing(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckPortPermission(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckPortHeld(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckPortName(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckPortProber(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckUsbLatency(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckAdapterRate(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckSpiBuffer(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
