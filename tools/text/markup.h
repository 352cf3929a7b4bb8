#pragma once

#include <string>
#include <string_view>

namespace axlecast {

// Text within an element or a quoted attribute of HTML or XML: what is no UTF-8 is mended, what no page may hold becomes
// U+FFFD.
[[nodiscard]] std::string EscapedMarkup(std::string_view text);

}  // namespace axlecast
