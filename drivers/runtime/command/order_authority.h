#pragma once

#include <axlecast/driver_command_t.hpp>
#include <optional>
#include <string_view>

#include "core/config/machine_config.h"

namespace axlecast {

// Whose orders a driver obeys: those that the bridge's key signed; where the machine's file names none, all where it
// allows unsigned commands, else none.
class OrderAuthority {
 public:
  explicit OrderAuthority(const BridgeConfig& bridge)
      : key_(bridge.bridge.public_key), allow_unsigned_(bridge.allow_unsigned) {}

  [[nodiscard]] bool Allows(const driver_command_t& envelope) const;
  // For the log: who is obeyed, and what to do where that is nobody.
  [[nodiscard]] std::string_view Rule() const;

 private:
  const std::optional<PublicKey> key_;
  const bool allow_unsigned_;
};

}  // namespace axlecast
