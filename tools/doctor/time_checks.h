#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// What a machine's timing stands on: priorities, processors, clocks.
[[nodiscard]] Findings CheckRealtimePriority(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckRealtimeMemory(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckRealtimeCpu(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckCpuGovernor(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckClockSource(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckClockSync(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
