#pragma once

#include <axlecast/permit_body_t.hpp>
#include <axlecast/permit_t.hpp>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/axlecast/client_settings.h"
#include "client/axlecast/command.h"
#include "core/base/result.h"
#include "core/base/secret.h"
#include "core/base/time.h"
#include "core/command/keys.h"

namespace axlecast {

// The own key of a client, and the key of the bridge whose answers it accepts.
struct ClientKeys {
  std::shared_ptr<const SigningKey> own;  // null: messages are sent unsigned
  std::optional<PublicKey> bridge;        // nothing: every status is accepted
};

// Loads the keys that `settings` name. Fails if one of them cannot be used.
[[nodiscard]] Result<ClientKeys> LoadClientKeys(const ClientSettings& settings, SecretSource& secrets);

// The content of a command_t.
struct SignedBody {
  std::vector<std::uint8_t> bytes;  // an encoded command_body_t
  Signature signature{};            // 0: unsigned
};

// The boot of the bridge that a body is meant for, and its CLOCK_MONOTONIC when the body is made.
struct BridgeTimestamp {
  std::int64_t boot_id = 0;
  MonoNs mono = 0;
};

// The request under `id`, in `mode` (command_body_t MODE_*); MODE_QUERY has QueryBody.
[[nodiscard]] SignedBody MakeBody(const CommandId& id, const CommandRequest& request, std::int8_t mode,
                                  BridgeTimestamp bridge, const ClientKeys& keys);
// Asks for the state of `id`; needs no key and no boot of the bridge.
[[nodiscard]] SignedBody QueryBody(const CommandId& id);

// Checks that the request fits into a command. Nothing is truncated.
[[nodiscard]] Result<> CheckForm(const CommandRequest& request);

// `body` with its key_id, encoded and signed; a null `key` leaves it unsigned. The head is left open.
[[nodiscard]] permit_t MakePermit(permit_body_t body, const SigningKey* key);

// Whether PERMIT/<device> can carry it: no name empty, longer than 64 bytes or with a NUL byte, at most 24 operations.
[[nodiscard]] bool FitsPermit(const std::string& device, const std::vector<std::string>& operations);

}  // namespace axlecast
