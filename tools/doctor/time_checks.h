#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// What a machine's timing stands on: priorities, processors, clocks.
[[nodiscard]] Symptoms CheckRealtimePriority(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckRealtimeMemory(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckRealtimeCpu(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCpuGovernor(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckClockSource(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckClockSync(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
