#pragma once

#include <string>
#include <string_view>

namespace axlecast {

// Returns text from outside as a terminal, a log or a page may show it on one line. Replaced by '?' are: control
// characters (C0, DEL and C1), characters that change the direction of text or have no width, separators of lines and
// paragraphs, and bytes that are no UTF-8. All other characters stay.
[[nodiscard]] std::string VisibleText(std::string_view text);

// Returns the beginning of `text`, at most `size` bytes, that ends between two characters of UTF-8.
[[nodiscard]] std::string_view Shortened(std::string_view text, std::size_t size);

}  // namespace axlecast
