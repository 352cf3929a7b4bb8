#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// CAN interfaces of the machine's file.
[[nodiscard]] Findings CheckCanMissing(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckCanDown(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckCanBitrate(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckCanMode(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckCanRestart(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckCanState(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckCanQueue(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
