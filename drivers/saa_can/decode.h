#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/device/family.h"

namespace axlecast::saa_can {

// For Family::decode: one frame as its packet (core/can_frame.h), as the flat JSON object of docs/decode.md. With
// `model=cia406` it is a standard encoder's.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes packet);

}  // namespace axlecast::saa_can
