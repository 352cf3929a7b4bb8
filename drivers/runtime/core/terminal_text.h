#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace axlecast {

// Texts from the network, files and their names, on their way to a person's terminal.

// Part of a text that could steer a terminal or deceive its reader: a control character other than tab and newline (C0,
// DEL, C1), a character that changes the direction of writing or ends a line (Unicode's bidi controls, U+2028, U+2029),
// or bytes that are no UTF-8.
struct UnsafePart {
  std::size_t begin = 0;
  std::size_t size = 0;
  char32_t code = 0;  // U+FFFD where it is no UTF-8
};
// The first one at or after `from`.
[[nodiscard]] std::optional<UnsafePart> FindUnsafe(std::string_view text, std::size_t from = 0);

// The text with U+FFFD in place of each unsafe part.
[[nodiscard]] std::string TerminalText(std::string_view text);

// How many bytes at the end of the text may be the beginning of a character; at most 3.
[[nodiscard]] std::size_t UnfinishedBytes(std::string_view text);

}  // namespace axlecast
