#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/key.h"
#include "core/base/secret.h"

namespace axlecast {

// What a key may do. Everybody may ask for the state of a command.
enum class Role : std::uint8_t {
  kObserver,    // operations that only read
  kOperator,    // and those that are not destructive
  kControl,     // a control process: as an operator, and it issues permits
  kMaintainer,  // and the destructive ones
};

// Somebody whose signed commands or permits are obeyed.
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

}  // namespace axlecast
