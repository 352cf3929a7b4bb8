#pragma once

#include <optional>
#include <string_view>

#include "tools/axlecast/decode/hex_line.h"

namespace axlecast {

// A CAN frame as can-utils write it, as its packet (core/device/can_frame.h). Taken are what cansend takes
// and candump prints:
//   120#4726000000000000                          3 digits: 11 bits of identifier; 8 digits: 29
//   120#R                                         a remote frame
//   (1436509052.249713) can0 120#4726             candump -L
//   can0  120   [8]  47 26 00 00 00 00 00 00      candump; "remote request" in place of the data
// Nothing when the text is not written so. `# ` begins a comment.
[[nodiscard]] std::optional<HexLine> ParseCanNotation(std::string_view text);

}  // namespace axlecast
