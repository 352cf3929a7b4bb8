#pragma once

#include <optional>
#include <string>

#include "core/base/secret.h"
#include "core/command/key_grant.h"
#include "core/command/signature.h"

namespace axlecast {

// A secret key from where it is kept. Nothing and an empty `problem` when it has no place; nothing and a problem that
// names the place, the cause and the remedy when it cannot be read, is no key, or is not the secret half of the
// configured public key. A problem never holds the content.
[[nodiscard]] std::optional<SigningKey> LoadKey(const OwnKey& own, SecretSource& secrets, std::string& problem);
[[nodiscard]] std::optional<SigningKey> LoadKey(const KeyGrant& grant, SecretSource& secrets, std::string& problem);

// The key of a file, whatever its public half.
[[nodiscard]] std::optional<SigningKey> LoadKeyFile(const std::string& path, SecretSource& secrets,
                                                    std::string& problem);

}  // namespace axlecast
