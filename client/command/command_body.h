#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/axlecast/command.h"
#include "client/command/client_key.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/command/signature.h"

namespace axlecast {

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

}  // namespace axlecast
