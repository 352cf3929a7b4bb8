#pragma once

#include <string>

#include "tools/doctor/check.h"

namespace axlecast {

// The accounts that the package makes: each process has its own, and reads its own key only (docs/install.md). A host
// without them, such as a desk, has nothing to check.

inline constexpr const char* kOperators = "axlecast";  // group of persons
inline constexpr const char* kDriversAccount = "axlecast-drivers";

// Whether the machine's processes run under these accounts: they exist, and the file is the one that the units read.
[[nodiscard]] bool RunsUnderAccounts(const MachineConfig& machine, const HostFacts& host);

[[nodiscard]] Symptoms CheckKeyAccess(const MachineConfig& machine, const HostFacts& host);
[[nodiscard]] Symptoms CheckGroupMembers(const MachineConfig& machine, const HostFacts& host);

}  // namespace axlecast
