#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace axlecast {

// Texts from the network, files and their names, on their way to a person's terminal, a log or a page. For columns, in which
// each byte must take one place, Printable (core/base/table_layout.h) leaves ASCII alone.

enum class TextShape : std::uint8_t {
  kLines,    // texts of any language, of several lines: tabs and newlines stay
  kOneLine,  // a name or a value within a line: what breaks the line or cannot be seen is unsafe too
};

// Part of a text that could steer a terminal or deceive its reader: a control character (C0, DEL, C1), a character that
// changes the direction of writing or ends a line (Unicode's bidi controls, U+2028, U+2029), or bytes that are no UTF-8. In
// one line also tab, newline, and what has no width.
struct UnsafePart {
  std::size_t begin = 0;
  std::size_t size = 0;
  char32_t code = 0;  // U+FFFD where it is no UTF-8
};
// Returns the first one at or after `from`.
[[nodiscard]] std::optional<UnsafePart> FindUnsafe(std::string_view text, std::size_t from = 0,
                                                   TextShape shape = TextShape::kLines);

// Returns the text with U+FFFD in place of each unsafe part.
[[nodiscard]] std::string TerminalText(std::string_view text, TextShape shape = TextShape::kLines);

// Returns how many bytes at the end of the text may be the beginning of a character; at most 3.
[[nodiscard]] std::size_t UnfinishedBytes(std::string_view text);

}  // namespace axlecast
