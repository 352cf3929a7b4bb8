#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace axlecast {

// The word of `known` that `word` is probably meant to be; nothing when none is near.
[[nodiscard]] std::optional<std::string> NearestWord(std::string_view word, const std::vector<std::string>& known);

// "a, b, c"
[[nodiscard]] std::string Listed(const std::vector<std::string>& words);

// A value of the file as an error message shows it: in quotes, shortened, control characters made visible.
[[nodiscard]] std::string Quoted(std::string_view value);

// Of machines, buses, devices, passwords, keys and logs.
[[nodiscard]] bool IsName(std::string_view text);
inline constexpr const char* kNameRule = " is no name: 1 to 24 of a-z, 0-9, _ and -";

}  // namespace axlecast
