#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// CAN interfaces of the machine's file.
[[nodiscard]] Symptoms CheckCanMissing(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanDown(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanBitrate(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanMode(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanRestart(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanState(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanQueue(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
