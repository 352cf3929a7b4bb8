#pragma once

#include <string>
#include <vector>

namespace axlecast {

// One record of CSV by RFC 4180: cells that hold commas, quotes or line ends are quoted; CR LF at its end. What is not
// UTF-8, and NUL, becomes U+FFFD. A spreadsheet takes a cell that begins with = + - @, tab or CR for a formula, quoted or
// not: such a cell gets an apostrophe before it, unless it is a number.
[[nodiscard]] std::string CsvLine(const std::vector<std::string>& cells);

}  // namespace axlecast
