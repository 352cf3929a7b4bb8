#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/device/family.h"

namespace axlecast::saa_modbus {

// One captured frame of an SAA encoder on Modbus, request or reply, as the object of docs/decode.md and README.md:
// Family::decode. Setting: `bits` 10..26, without which there is no angle and no check against the resolution.
//
// A frame that stands alone has lost its request: a reply from another address than asked for is never found here.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);

}  // namespace axlecast::saa_modbus
