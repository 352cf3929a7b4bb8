#pragma once

#include <cstdint>
#include <string_view>

#include "core/base/inline_bytes.h"
#include "drivers/tsubaki_sc/register_map.h"

namespace axlecast::tsubaki_sc {

// How a password stands in its eight registers.
struct PasswordFormat {
  CharacterOrder order = CharacterOrder::kHighFirst;
  std::uint8_t padding = 0x00;  // NUL, or a space 0x20: guideline 11
};

// 8 to 16 characters of '!' (0x21) to '~' (0x7E): guideline 11. The text prints the last as "-(0x7E)".
[[nodiscard]] bool IsPassword(std::string_view text);

// Function 16 on `block` (kLoginBlock or kPassword). `text` must be a password. Whoever holds the frame wipes it.
[[nodiscard]] Frame WritePassword(std::uint8_t address, const Block& block, std::string_view text,
                                  const PasswordFormat& format);

// Registers 200-207 as they were read hold that password, padded with NULs (guideline 11) or as it was written.
[[nodiscard]] bool HoldsPassword(Bytes registers, std::string_view text, CharacterOrder order);

void Wipe(Frame& frame);

}  // namespace axlecast::tsubaki_sc
