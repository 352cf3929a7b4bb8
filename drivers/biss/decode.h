#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/device/family.h"

namespace axlecast::biss {

// For Family::decode; README.md, "Decoding", describes the object.
[[nodiscard]] nlohmann::ordered_json Decode(const DecodeSettings& settings, Bytes frame, bool* usable);

}  // namespace axlecast::biss
