#pragma once

#include <string>
#include <string_view>

namespace axlecast {

// The text with what is not UTF-8 replaced by U+FFFD.
[[nodiscard]] std::string MendedUtf8(std::string_view text);

}  // namespace axlecast
