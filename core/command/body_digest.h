#pragma once

#include <cstdint>

#include "core/base/inline_bytes.h"

namespace axlecast {

// command_status_t.body_digest: the first 8 bytes, big-endian, of BLAKE2b-256 of an encoded command_body_t.
[[nodiscard]] std::int64_t BodyDigest(Bytes body);

}  // namespace axlecast
