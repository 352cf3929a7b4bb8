#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// Bits written by hand or by another tool, in the order in which they were clocked in.
struct BitLine {
  std::vector<std::uint8_t> bytes;  // the first bit is the first byte's most significant; zeros fill up the last
  std::size_t bits = 0;
  std::string problem;  // empty when all of the text was read; names the column and what stands there
};

// Digits 0 and 1. Between them: nothing, or blanks, tabs, commas, colons, semicolons, dashes, underscores. `0b` may
// stand before a group. `#` ends the text: what follows is a comment.
[[nodiscard]] BitLine ParseBitLine(std::string_view text);

}  // namespace axlecast
