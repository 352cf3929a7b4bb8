#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace axlecast::tformat {

using Arguments = std::vector<std::pair<std::string, std::string>>;

// The value of an argument; nothing when it is not given.
[[nodiscard]] std::optional<std::string_view> FindArgument(const Arguments& arguments, std::string_view name);

// A decimal or 0x... number within [min, max]; nothing when it is none.
[[nodiscard]] std::optional<std::size_t> ParseCount(std::string_view text, std::size_t min, std::size_t max);

// "A1 05" or "A105"; nothing when it is empty or no such thing.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> ParseHex(std::string_view text);

// An operation with its arguments as on a command line: "eeprom_write address=72 data=A105".
struct CommandLine {
  std::string operation;
  Arguments arguments;
};
[[nodiscard]] CommandLine ParseCommandLine(std::string_view text);

}  // namespace axlecast::tformat
