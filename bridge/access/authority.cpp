#include "bridge/access/authority.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <cstdio>
#include <utility>

#include "core/base/text.h"
#include "core/command/keys.h"
#include "core/command/signature.h"

namespace axlecast {
namespace {

using S = command_status_t;

// Every text must fit command_status_t.text; names of the machine's file have 24 bytes at most, operations too.
tl::unexpected<Error> Denied(std::string text) { return Failure(std::move(text), S::REASON_DENIED); }

std::string Hex(std::int64_t id) {
  char text[20];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(id));
  return text;
}

bool HasSignature(const command_t& envelope) {
  return std::any_of(std::begin(envelope.sig), std::end(envelope.sig), [](std::uint8_t byte) { return byte != 0; });
}

// An empty list names everything.
bool Names(const std::vector<std::string>& list, std::string_view name) {
  return list.empty() || std::find(list.begin(), list.end(), name) != list.end();
}

Result<Caller> Unsigned(const BridgeConfig& config) {
  if (config.allow_unsigned) return Caller{.who = "unsigned"};
  return Failure(config.keys.empty() ? "it is not signed, and the machine's file names no key that could: "
                                       "docs/keys.md sets them up"
                                     : "it is not signed: send it with a key of the machine's file (axlecast "
                                       "... --key FILE)",
                 S::REASON_UNSIGNED);
}

}  // namespace

Result<Caller> Authority::Identify(const command_t& envelope, const command_body_t& body) const {
  const bool has_signature = HasSignature(envelope);
  if (body.key_id == 0 && !has_signature) return Unsigned(config_);
  if (body.key_id == 0) return Failure("it is signed, but names no key (key_id 0)", S::REASON_BAD_SIGNATURE);
  const KeyGrant* grant = config_.FindKey(body.key_id);
  if (grant == nullptr) {
    return Failure("key " + Hex(body.key_id) +
                       " is not in the bridge's machine file: add its public half to "
                       "bridge.keys and restart the bridge (docs/keys.md)",
                   S::REASON_BAD_SIGNATURE);
  }
  if (!Verify(grant->key, Domain::kCommand, envelope.body, SignatureOf(envelope))) {
    return Failure("its signature is not of key " + grant->name + " (" + Hex(body.key_id) +
                       "): it was changed on its way, or forged",
                   S::REASON_BAD_SIGNATURE);
  }
  return Caller{.who = grant->name, .key_id = grant->id, .grant = grant};
}

Result<> Authority::Check(const Caller& caller, std::string_view device, const OperationSpec& operation) const {
  if (caller.grant == nullptr) return {};  // Identify has let it pass
  const KeyGrant& grant = *caller.grant;
  const std::string key = "key " + grant.name;
  const std::string name = CappedText(operation.name, kNameBytes);
  if (!IsAllowed(grant.role, operation)) {
    return Denied(key + " has role " + std::string(RoleName(grant.role)) + ": " + name + " needs " +
                  std::string(AllowedRoles(operation)));
  }
  if (!Names(grant.devices, device)) {
    return Denied(key + " is not for device " + CappedText(device, kNameBytes) + " (bridge.keys." + grant.name +
                  ".devices)");
  }
  if (!Names(grant.operations, operation.name)) {
    return Denied(key + " is not for operation " + name + " (bridge.keys." + grant.name + ".operations)");
  }
  return {};
}

bool Authority::MayCancel(const Caller& caller, std::string_view who_sent_it) const {
  return caller.who == who_sent_it || (caller.grant != nullptr && caller.grant->role == Role::kMaintainer);
}

}  // namespace axlecast
