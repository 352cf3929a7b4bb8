#pragma once

#include "tools/doctor/check.h"

namespace axlecast {

// Files of keys, and the machine's file itself.
[[nodiscard]] Symptoms CheckKeyMissing(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckKeyMode(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckKeyOwner(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckKeyPermission(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckConfigMode(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
