#pragma once

#include <string>
#include <string_view>

namespace axlecast {

// Text within an element or a quoted attribute of HTML or XML: what is no UTF-8 is mended; control characters, those that
// change the direction of writing, and what XML does not allow become U+FFFD.
[[nodiscard]] std::string EscapedMarkup(std::string_view text);

}  // namespace axlecast
