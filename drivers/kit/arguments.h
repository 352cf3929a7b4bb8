#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/operation.h"

namespace axlecast {

// Returns the value of an argument; nothing if it is not given.
[[nodiscard]] std::optional<std::string_view> FindArgument(const Arguments& arguments, std::string_view name);

// Returns a whole number, decimal or 0x..., within [min, max]; nothing if the text is not one.
[[nodiscard]] std::optional<std::int64_t> ParseWhole(std::string_view text, std::int64_t min, std::int64_t max);

// Returns the bytes of "A1 05" or "A105"; nothing if the text is empty or is not hexadecimal.
[[nodiscard]] std::optional<std::vector<std::uint8_t>> ParseHex(std::string_view text);

// The same for the value of an argument; nothing if it is not given either.
[[nodiscard]] std::optional<std::int64_t> WholeArgument(const Arguments& arguments, std::string_view name,
                                                        std::int64_t min, std::int64_t max);
[[nodiscard]] std::optional<std::vector<std::uint8_t>> HexArgument(const Arguments& arguments,
                                                                   std::string_view name);

// OperationSpec::writes of an operation that writes once, whatever its arguments are.
[[nodiscard]] inline std::int32_t OneWrite(const Arguments&) { return 1; }

// Returns the operation as one that moves the datum with one write, and needs a standstill and a permit.
[[nodiscard]] inline OperationSpec MovingDatum(OperationSpec operation) {
  operation.destructive = operation.needs_standstill = operation.needs_permit = operation.moves_datum = true;
  operation.writes = &OneWrite;
  return operation;
}

// Returns the operation as one that only reads.
[[nodiscard]] inline OperationSpec ReadOnly(OperationSpec operation) {
  operation.reads_only = true;
  operation.verification = "it is a reading";
  return operation;
}

// An operation with its arguments, as on a command line: "eeprom_write address=72 data=A105".
struct CommandLine {
  std::string operation;
  Arguments arguments;
};
[[nodiscard]] CommandLine ParseCommandLine(std::string_view text);

// The argument `after` of a read that verifies another operation (OperationSpec::verified_by_operation).
inline constexpr ArgumentSpec kAfterArgument = {
    "after", "an operation with its arguments, to see whether it took effect", false};
// Returns the operation that `after` names; nothing if it is not given.
[[nodiscard]] std::optional<CommandLine> AfterArgument(const Arguments& arguments);

}  // namespace axlecast
