#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/base/secret.h"
#include "core/command/signature.h"
#include "core/device/operation.h"

namespace axlecast {

// What a key may do. Without a key, everybody may query the state of a command.
enum class Role : std::uint8_t {
  kObserver,    // operations that only read
  kOperator,    // and those that are not destructive
  kControl,     // a control process: as an operator, and it issues permits
  kMaintainer,  // and the destructive ones
};

// A key whose signed commands or permits are accepted.
struct KeyGrant {
  std::string name;
  PublicKey key{};
  std::int64_t id = 0;  // KeyId
  Role role = Role::kObserver;
  std::vector<std::string> devices;     // empty: all
  std::vector<std::string> operations;  // empty: all that the role allows; never more than those
  SecretPlace place;                    // of the secret key on this host; empty: it is elsewhere
};

// A key that a process of the machine signs with.
struct OwnKey {
  std::optional<PublicKey> public_key;
  SecretPlace place;
};

// The roles' names in the order of Role.
inline constexpr std::array<std::string_view, 4> kRoleNames = {"observer", "operator", "control", "maintainer"};
[[nodiscard]] std::string_view RoleName(Role role);

// Returns true if a key of this role may command the operation.
[[nodiscard]] bool IsAllowed(Role role, const OperationSpec& operation);

// Returns these roles as text: "operator, control or maintainer".
[[nodiscard]] std::string_view AllowedRoles(const OperationSpec& operation);

// Loads a secret key from its place. Returns nothing if no place is configured. Fails if the place cannot be read, holds no
// key, or holds another key than the secret half of the configured public key. An error never contains the key.
[[nodiscard]] Result<std::optional<SigningKey>> LoadKey(const OwnKey& own, SecretSource& secrets);
[[nodiscard]] Result<std::optional<SigningKey>> LoadKey(const KeyGrant& grant, SecretSource& secrets);

// Loads the key of a file. Does not check its public half.
[[nodiscard]] Result<SigningKey> LoadKeyFile(const std::string& path, SecretSource& secrets);

}  // namespace axlecast
