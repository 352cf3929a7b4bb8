#pragma once

#include "core/base/result.h"
#include "core/base/secret.h"

namespace axlecast {

// Secrets from files and systemd credentials. A file must be a regular one, of at most 4 KiB without NUL, owned by
// this user or root, and closed to everybody else (but for its group to read, where its place allows that); a
// credential must not be open to all.
class SecretFiles final : public SecretSource {
 public:
  [[nodiscard]] Result<Secret> Read(const SecretPlace& place) override;
};

}  // namespace axlecast
