#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"

namespace axlecast {

// UTF-8 as RFC 3629 defines it: overlong forms, surrogates and codes above U+10FFFF are not UTF-8.

struct Utf8Character {
  char32_t code = 0;
  std::size_t size = 0;  // bytes; 0: the text does not begin with a character of UTF-8
};

// Returns the first character of `text`, which must not be empty.
[[nodiscard]] Utf8Character FirstCharacter(std::string_view text);

// Returns the bytes of the character that begins with `lead`, 1 to 4; 0 if no character begins so.
[[nodiscard]] std::size_t CharacterSize(std::uint8_t lead);

// Returns true for the second to last byte of a character.
[[nodiscard]] constexpr bool IsContinuation(char byte) {
  return (static_cast<std::uint8_t>(byte) & 0xC0U) == 0x80U;
}

// Returns the beginning of `text`, at most `size` bytes, that ends between two characters.
[[nodiscard]] constexpr std::string_view Shortened(std::string_view text, std::size_t size) {
  if (text.size() <= size) return text;
  while (size > 0 && IsContinuation(text[size])) --size;
  return text.substr(0, size);
}

// Returns the text with U+FFFD in place of what is not UTF-8.
[[nodiscard]] std::string MendedUtf8(std::string_view text);

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

// Text within an element or a quoted attribute of HTML or XML: bytes that are not UTF-8 are replaced; control characters, those that
// change the direction of writing, and what XML does not allow become U+FFFD.
[[nodiscard]] std::string EscapedMarkup(std::string_view text);

// Byte limits of the strings in command messages, as lcmtypes/ documents them.
inline constexpr std::size_t kNameBytes = 24;
inline constexpr std::size_t kTextBytes = 200;
inline constexpr std::size_t kReasonBytes = 160;
inline constexpr std::size_t kArgumentBytes = 160;
inline constexpr std::size_t kChangeBytes = 80;
inline constexpr std::size_t kIdentityBytes = 64;
inline constexpr std::size_t kMaxChanges = 4;
inline constexpr std::size_t kMaxArguments = 16;

// Ends what was cut.
inline constexpr std::string_view kCutMark = "\u2026";  // three bytes

// The whole words in the first `room` bytes of a longer text, then the mark. A word that fills half of the room (a path)
// is cut itself, because little would be left without it. The one place where sentences are cut.
[[nodiscard]] std::string CutText(std::string_view text, std::size_t room);

// `text` within `bytes`. Bytes that are no UTF-8 and control characters become '?', so that the result can be shown and
// logged wherever it came from. A sentence that is too long is cut as by CutText. A single word (a name) ends between two
// UTF-8 characters, without a mark.
[[nodiscard]] std::string CappedText(std::string_view text, std::size_t bytes);

// The words with a blank between them; where they have not all room within `bytes`, those that have, then kAndMore.
inline constexpr std::string_view kAndMore = "*";
[[nodiscard]] std::string WordsWithin(std::span<const std::string> words, std::size_t bytes);

// Text in columns, for terminals.

// Returns bytes from the network as text for a column: each byte that is not printable ASCII becomes '?', but for the mark of a
// text that was cut. Unlike TerminalText it leaves no character of an unknown width.
[[nodiscard]] std::string Printable(std::string_view text);

// Pad or cut to exactly `width` columns, like CutText.
[[nodiscard]] std::string Left(std::string_view text, std::size_t width);
[[nodiscard]] std::string Right(std::string_view text, std::size_t width);

// Cuts to at most `width` columns, like CutText.
[[nodiscard]] std::string Clip(std::string_view text, std::size_t width);

// Fixed point, "-" when the value is not known (NaN, infinite). Beyond 10^12 in scientific notation.
[[nodiscard]] std::string Decimal(double value, int decimals);

// printf's formats, cut to the 200 bytes that an outcome may have.
[[nodiscard]] __attribute__((format(printf, 1, 2))) std::string Text(const char* format, ...);

// "a105", and "A1 05"
[[nodiscard]] std::string HexDigits(Bytes bytes);
[[nodiscard]] std::string HexText(Bytes bytes);

// Formats the words as a shell accepts them.
[[nodiscard]] std::string ShellText(const std::vector<std::string>& words);

}  // namespace axlecast
