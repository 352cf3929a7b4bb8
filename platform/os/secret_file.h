#pragma once

#include "core/base/result.h"
#include "core/base/secret.h"

namespace axlecast {

// Reads secrets from files and systemd credentials. A file must be regular, at most 4 KiB without NUL, owned by this user or
// root, and not accessible for others, except that its group may read it if the configuration allows that. A credential must
// not be accessible for all.
class SecretFiles final : public SecretSource {
 public:
  [[nodiscard]] Result<Secret> Read(const SecretPlace& place) override;
};

}  // namespace axlecast
