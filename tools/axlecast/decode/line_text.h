#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace axlecast {

// What the readers of frames that somebody wrote down have in common (hex_line.h, bit_line.h).

// May stand between two groups of digits.
inline constexpr std::string_view kGroupSeparators = " \t\r,:;-";

// What stands before the first `#`: the rest is a comment.
[[nodiscard]] std::string_view WithoutComment(std::string_view text);

// "'G'", or "byte 0x00" where it cannot be printed.
[[nodiscard]] std::string ShownCharacter(char c);

// "column 4: ..." of the character at `index`.
[[nodiscard]] std::string AtColumn(std::size_t index, std::string_view what);

}  // namespace axlecast
