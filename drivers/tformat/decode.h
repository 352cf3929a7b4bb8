#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/device/family.h"

namespace axlecast::tformat {

// One captured T-format frame, request or reply, as the object that docs/decode.md describes: Family::decode.
// Settings, later ones win: `bits` 1..24 (single-turn, default 17), `turn_bits` 0..24 (multi-turn, default 16),
// `enid` 0..255 or 0x00..0xff (the encoder ID that must answer; default any), `model` (all three of a known model).
//
// A frame that stands alone has lost its request: it is judged as the reply to the request that its own control
// field names. An echo error is therefore never found here.
[[nodiscard]] nlohmann::ordered_json Decode(const DecodeSettings& settings, Bytes frame, bool* usable);

}  // namespace axlecast::tformat
