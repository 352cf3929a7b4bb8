#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace axlecast {

// Text in columns, for terminals.

// Bytes from the network as text that cannot steer a terminal: what is not printable ASCII becomes '?'.
[[nodiscard]] std::string Printable(std::string_view text);

// Exactly `width` columns; longer text is cut and ends in '~'.
[[nodiscard]] std::string Left(std::string_view text, std::size_t width);
[[nodiscard]] std::string Right(std::string_view text, std::size_t width);

// At most `width` columns; longer text is cut and ends in '~'.
[[nodiscard]] std::string Clip(std::string_view text, std::size_t width);

// Fixed point, "-" when the value is not known (NaN, infinite). Beyond 10^12 in scientific notation.
[[nodiscard]] std::string Decimal(double value, int decimals);

}  // namespace axlecast
