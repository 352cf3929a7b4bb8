#pragma once

#include <string>

#include "tools/doctor/check.h"

namespace axlecast {

// The functions of the checks; check.cpp has their names and texts.

// LCM between the processes of a machine: routes, loopback, firewall, buffers, other machines, and reported faults.
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

// Serial ports, SPI devices and GPIO chips of the machine file.
[[nodiscard]] Symptoms CheckPortMissing(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckPortPermission(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckPortHeld(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckPortName(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckPortProber(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckUsbLatency(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckAdapterRate(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckSpiBuffer(const MachineConfig& machine, const HostFacts& host);

// Real time: priorities, processors, clocks.
[[nodiscard]] Symptoms CheckRealtimePriority(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckRealtimeMemory(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckRealtimeCpu(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCpuGovernor(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckClockSource(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckClockSync(const MachineConfig& machine, const HostFacts& host);

// CAN interfaces of the machine file.
[[nodiscard]] Symptoms CheckCanMissing(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanDown(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanBitrate(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanMode(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanRestart(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanState(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckCanQueue(const MachineConfig& machine, const HostFacts& host);

// The folders of the recorder's logs and of the bridge's journal.
[[nodiscard]] Symptoms CheckLogFolder(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckLogSpace(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckLogFileSystem(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckJournalFolder(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckJournalSpace(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckJournalFileSystem(const MachineConfig& machine, const HostFacts& host);

// The key files and the machine file.
[[nodiscard]] Symptoms CheckKeyMissing(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckKeyMode(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckKeyOwner(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckKeyPermission(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckConfigMode(const MachineConfig& machine, const HostFacts& host);

// The accounts of the package: each process has its own account and reads only its own key (docs/install.md). On a host
// without these accounts, the checks find nothing.
inline constexpr const char* kDriversAccount = "axlecast-drivers";

// Returns true if the machine runs under these accounts: they exist, and the units read this machine file.
[[nodiscard]] bool RunsUnderAccounts(const MachineConfig& machine, const HostFacts& host);

[[nodiscard]] Symptoms CheckKeyAccess(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckGroupMembers(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
