#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/device/family.h"

namespace axlecast::ssi {

// For Family::decode; docs/decode.md describes settings and object.
[[nodiscard]] nlohmann::ordered_json Decode(const DecodeSettings& settings, Bytes frame, bool* usable);

}  // namespace axlecast::ssi
