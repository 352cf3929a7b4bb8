#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// Files of keys, and the machine's file itself.
[[nodiscard]] Findings CheckKeyMissing(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckKeyMode(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckKeyOwner(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckKeyPermission(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Findings CheckConfigMode(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
