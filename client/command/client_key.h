#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "client/axlecast/client_settings.h"
#include "core/base/secret.h"
#include "core/command/signature.h"
#include "core/config/machine_config.h"

namespace axlecast {

// Who a client is, and whom it believes.
struct ClientKeys {
  std::shared_ptr<const SigningKey> own;  // null: what it sends is unsigned
  std::optional<PublicKey> bridge;        // nothing: every status is believed
};

// The keys that `settings` name. Nothing, and a `problem`, when one of them cannot be used.
[[nodiscard]] std::optional<ClientKeys> LoadClientKeys(const ClientSettings& settings, SecretSource& secrets,
                                                       std::string& problem);

// The settings of the machine's clients; the own key is left open.
[[nodiscard]] ClientSettings SettingsOf(const MachineConfig& machine);

// The first of the machine's keys, of `role` where one is given, whose secret half can be read here; null: none.
[[nodiscard]] const KeyGrant* ReadableKey(const MachineConfig& machine, std::optional<Role> role,
                                          SecretSource& secrets);

}  // namespace axlecast
