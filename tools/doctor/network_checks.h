#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// LCM between the processes of a machine: routes, loopback, firewall, buffers, neighbours, and what the machine reports.
[[nodiscard]] Symptoms CheckMulticastRoute(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckLoopbackMulticast(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckMulticastInterface(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckMulticastSilent(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckFirewall(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckReceiveBufferMax(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckReceiveBufferDefault(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckLcmLibrary(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckOtherMachine(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckDuplicateDriver(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckMachineFaults(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
