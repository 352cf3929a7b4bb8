#pragma once

#include <optional>

#include "client/axlecast/client_settings.h"
#include "core/base/secret.h"
#include "core/command/keys.h"
#include "core/config/machine_config.h"

namespace axlecast {

// Returns the settings of the machine's clients, without an own key.
[[nodiscard]] ClientSettings SettingsOf(const MachineConfig& machine);

// Returns the first key of the machine whose secret half can be read on this host; null if no key can be read. If `role` is given,
// only keys of that role are considered.
[[nodiscard]] const KeyGrant* ReadableKey(const MachineConfig& machine, std::optional<Role> role,
                                          SecretSource& secrets);

}  // namespace axlecast
