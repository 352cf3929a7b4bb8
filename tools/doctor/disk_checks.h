#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// Where the recorder's logs and the bridge's journal are.
[[nodiscard]] Findings CheckLogFolder(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckLogSpace(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckLogFileSystem(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckJournalFolder(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckJournalSpace(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckJournalFileSystem(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
