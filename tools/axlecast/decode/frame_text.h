#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace axlecast {

// Frames as a person or another tool wrote them: in hex, as bits, or in the notation of can-utils. The text ends at `#`:
// a comment follows. Errors name the column and the character.

using FrameBytes = std::vector<std::uint8_t>;

// Parses two hex digits per byte, in either case. Separators between bytes are optional: blanks, tabs, commas, colons,
// semicolons, dashes. `0x` is allowed before a byte or before a run of bytes.
[[nodiscard]] Result<FrameBytes> ParseHexLine(std::string_view text);

struct BitLine {
  FrameBytes bytes;  // the first bit is the most significant bit of the first byte; zeros fill the last byte
  std::size_t bits = 0;
};
// Parses the digits 0 and 1 in the order in which the bits were clocked in. Separators are those of ParseHexLine and the
// underscore. `0b` is allowed before a group.
[[nodiscard]] Result<BitLine> ParseBitLine(std::string_view text);

// Parses a CAN frame in the notation of cansend or candump to a packet (core/device/can_frame.h):
//   120#4726000000000000                          3 digits: an 11-bit identifier; 8 digits: a 29-bit identifier
//   120#R                                         a remote frame
//   (1436509052.249713) can0 120#4726             candump -L
//   can0  120   [8]  47 26 00 00 00 00 00 00      candump; "remote request" instead of the data
// Returns nothing if the text has another notation.
[[nodiscard]] std::optional<Result<FrameBytes>> ParseCanNotation(std::string_view text);

}  // namespace axlecast
