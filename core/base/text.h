#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/inline_bytes.h"

namespace axlecast {

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
