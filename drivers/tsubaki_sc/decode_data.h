#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>

#include "core/base/inline_bytes.h"
#include "drivers/tsubaki_sc/register_map.h"

namespace axlecast::tsubaki_sc {

// Names for the data that stand at consecutive addresses, for decode. The four spaces of addresses are named by the
// function that reads them (Block::read).

// The unit has all these addresses, in one block (guideline 7).
[[nodiscard]] bool Exists(const Block& data);

// It holds the password of a login or the unit's own, in part or whole: never shown.
[[nodiscard]] bool HoldsSecret(const Block& data);

// Adds one key for each named value of `registers`, which stand at `data`: two bytes each, it exists and is no secret.
// False when a value cannot be: nothing of it may be shown then.
[[nodiscard]] bool AddRegisters(nlohmann::ordered_json& json, const Block& data, Bytes registers,
                                CharacterOrder order);

// The same of one coil or input.
void AddBit(nlohmann::ordered_json& json, const Block& data, bool on);

}  // namespace axlecast::tsubaki_sc
