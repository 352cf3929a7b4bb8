#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "client/axlecast/client_settings.h"
#include "core/base/result.h"
#include "core/base/secret.h"
#include "core/command/signature.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The own key of a client, and the key of the bridge whose answers it accepts.
struct ClientKeys {
  std::shared_ptr<const SigningKey> own;  // null: messages are sent unsigned
  std::optional<PublicKey> bridge;        // nothing: every status is accepted
};

// Loads the keys that `settings` name. Fails if one of them cannot be used.
[[nodiscard]] Result<ClientKeys> LoadClientKeys(const ClientSettings& settings, SecretSource& secrets);

// Returns the settings of the machine's clients, without an own key.
[[nodiscard]] ClientSettings SettingsOf(const MachineConfig& machine);

// Returns the first key of the machine whose secret half can be read on this host; null if no key can be read. If `role` is given,
// only keys of that role are considered.
[[nodiscard]] const KeyGrant* ReadableKey(const MachineConfig& machine, std::optional<Role> role,
                                          SecretSource& secrets);

}  // namespace axlecast
