#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// Bytes written by hand or by another tool.
struct HexLine {
  std::vector<std::uint8_t> bytes;
  std::string problem;  // empty when all of the text was read; names the column and what stands there
};

// Two hex digits a byte, in either case. Between bytes: nothing, or blanks, tabs, commas, colons, semicolons,
// dashes. `0x` may stand before a byte or before a run of bytes. `#` ends the text: what follows is a comment.
[[nodiscard]] HexLine ParseHexLine(std::string_view text);

}  // namespace axlecast
