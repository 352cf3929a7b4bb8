#pragma once

#include <memory>
#include <optional>

#include "core/command/signature.h"

namespace axlecast {

// Who a client is, and whom it believes.
struct ClientKeys {
  std::shared_ptr<const SigningKey> own;  // null: what it sends is unsigned
  std::optional<PublicKey> bridge;        // nothing: every status is believed
};

}  // namespace axlecast
