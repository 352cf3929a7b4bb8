#pragma once

#include <string>
#include <vector>

namespace axlecast {

// One record of CSV by RFC 4180: cells that hold commas, quotes or line ends are quoted; CR LF at its end. What is not
// UTF-8, and NUL, becomes U+FFFD.
[[nodiscard]] std::string CsvLine(const std::vector<std::string>& cells);

}  // namespace axlecast
