#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/device/family.h"

namespace axlecast::tsubaki_sc {

// One captured frame of an SC unit's line, request or reply, as the object that README.md describes: Family::decode.
// Settings, later ones win:
//   start    0..65535 or 0x..: the first address that was read; a read's reply does not contain it
//   request  the request in hex: the same, and the reply is checked against it
//   endian   high (default), low: which half of a register holds the first of its two characters
// The registers of a login and of the password are masked whatever the settings are; so are eight holding registers
// whose addresses are not known.
[[nodiscard]] Result<nlohmann::ordered_json> Decode(const DecodeSettings& settings, Bytes frame);

}  // namespace axlecast::tsubaki_sc
