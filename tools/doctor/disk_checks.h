#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// Where the recorder's logs and the bridge's journal are.
[[nodiscard]] Symptoms CheckLogFolder(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckLogSpace(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckLogFileSystem(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckJournalFolder(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckJournalSpace(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckJournalFileSystem(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
