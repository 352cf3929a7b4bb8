#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/operation.h"

namespace axlecast {

// The value of an argument; nothing when it is not given.
[[nodiscard]] std::optional<std::string_view> FindArgument(const Arguments& arguments, std::string_view name);

// A whole number, decimal or 0x..., within [min, max]; nothing when it is none.
[[nodiscard]] std::optional<std::int64_t> ParseWhole(std::string_view text, std::int64_t min, std::int64_t max);

// "A1 05" or "A105"; nothing when it is empty or no such thing.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> ParseHex(std::string_view text);

// OperationSpec::writes of what writes once, whatever its arguments.
[[nodiscard]] inline std::int32_t OneWrite(const Arguments&) { return 1; }

// An operation with its arguments as on a command line: "eeprom_write address=72 data=A105".
struct CommandLine {
  std::string operation;
  Arguments arguments;
};
[[nodiscard]] CommandLine ParseCommandLine(std::string_view text);

}  // namespace axlecast
