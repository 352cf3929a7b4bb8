#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// LCM between the processes of a machine: routes, loopback, firewall, buffers, neighbours, and what the machine reports.
[[nodiscard]] Findings CheckMulticastRoute(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckLoopbackMulticast(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckMulticastInterface(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckMulticastSilent(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckFirewall(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckReceiveBufferMax(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckReceiveBufferDefault(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckLcmLibrary(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckOtherMachine(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckDuplicateDriver(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckMachineFaults(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
