#include "drivers/runtime/command/order_authority.h"

#include "core/command/signature.h"

namespace axlecast {

bool OrderAuthority::Allows(const driver_command_t& envelope) const {
  if (!key_) return allow_unsigned_;
  return Verify(*key_, Domain::kOrder, envelope.order, SignatureOf(envelope));
}

std::string_view OrderAuthority::Rule() const {
  if (key_) return "orders count only when signed by bridge.key of the machine's file";
  if (allow_unsigned_) return "unsigned orders are obeyed, whoever sends them: bridge.unsigned_commands is allow";
  return "no order is obeyed: set bridge.key in the machine's file, or bridge.unsigned_commands: allow";
}

}  // namespace axlecast
