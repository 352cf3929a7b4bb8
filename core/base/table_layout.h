#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace axlecast {

// Text in columns, for terminals.

// Returns bytes from the network as text for a column: each byte that is not printable ASCII becomes '?', but for the mark of a
// text that was cut. Unlike TerminalText it leaves no character of an unknown width.
[[nodiscard]] std::string Printable(std::string_view text);

// Exactly `width` columns; longer text is cut, after a word where it has blanks (truncated_text.h).
[[nodiscard]] std::string Left(std::string_view text, std::size_t width);
[[nodiscard]] std::string Right(std::string_view text, std::size_t width);

// At most `width` columns; longer text is cut, after a word where it has blanks (truncated_text.h).
[[nodiscard]] std::string Clip(std::string_view text, std::size_t width);

// Fixed point, "-" when the value is not known (NaN, infinite). Beyond 10^12 in scientific notation.
[[nodiscard]] std::string Decimal(double value, int decimals);

}  // namespace axlecast
