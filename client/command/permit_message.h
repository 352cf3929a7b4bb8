#pragma once

#include <axlecast/permit_body_t.hpp>
#include <axlecast/permit_t.hpp>
#include <string>
#include <vector>

#include "core/command/signature.h"

namespace axlecast {

// `body` with its key_id, encoded and signed; a null `key` leaves it unsigned. The head is left open.
[[nodiscard]] permit_t MakePermit(permit_body_t body, const SigningKey* key);

// Whether PERMIT/<device> can carry it: no name empty, longer than 64 bytes or with a NUL byte, at most 24 operations.
[[nodiscard]] bool FitsPermit(const std::string& device, const std::vector<std::string>& operations);

}  // namespace axlecast
