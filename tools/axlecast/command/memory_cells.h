#pragma once

#include <axlecast/change_t.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/axlecast/command.h"

namespace axlecast {

// A device's memory as `eeprom_backup` reads it, in changes `eeprom_<address>` of bytes in hex, and its file. Pure.

using MemoryCells = std::map<std::size_t, std::uint8_t>;  // by address

// Changes of other names are left out. `problem` says what is malformed, else it stays empty.
[[nodiscard]] MemoryCells CellsOf(std::span<const change_t> changes, std::string& problem);

// The file of what a read brought: a comment that names operation, device and command, then one "key: bytes" a line.
[[nodiscard]] std::string MemoryFileText(const CommandResult& result);

struct MemoryFile {
  std::string device;  // as its comment says; empty: it says none
  MemoryCells cells;
  std::string problem;  // with the line; empty when it could be read
};
[[nodiscard]] MemoryFile ParseMemoryFile(std::string_view text);

// Neighbouring cells that are to get other bytes.
struct CellRun {
  std::size_t address = 0;
  std::vector<std::uint8_t> before;
  std::vector<std::uint8_t> after;
};
// Cells of `wanted` that `present` holds with another byte; at most `longest` in one run.
[[nodiscard]] std::vector<CellRun> CellRuns(const MemoryCells& present, const MemoryCells& wanted,
                                            std::size_t longest);

}  // namespace axlecast
