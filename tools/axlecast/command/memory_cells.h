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
#include "core/base/result.h"

namespace axlecast {

// The memory of a device as `eeprom_backup` reads it: changes `eeprom_<address>` with bytes in hex. And its file.

using MemoryCells = std::map<std::size_t, std::uint8_t>;  // by address

// Returns the cells of these changes; changes with other names are ignored. Fails if a change is malformed or none is a cell.
[[nodiscard]] Result<MemoryCells> CellsOf(std::span<const change_t> changes);

// Formats the file of a read: a comment with operation, device and command, then one "key: bytes" per line.
[[nodiscard]] std::string MemoryFileText(const CommandResult& result);

struct MemoryFile {
  std::string device;  // from its comment, or empty
  MemoryCells cells;
};
// Fails with the number of the malformed line, or if the file has no cells.
[[nodiscard]] Result<MemoryFile> ParseMemoryFile(std::string_view text);

// Consecutive cells that change.
struct CellRun {
  std::size_t address = 0;
  std::vector<std::uint8_t> before;
  std::vector<std::uint8_t> after;
};
// Returns the cells of `target` that have another byte in `present`, at most `max_cells` in one run.
[[nodiscard]] std::vector<CellRun> CellRuns(const MemoryCells& present, const MemoryCells& target,
                                            std::size_t max_cells);

}  // namespace axlecast
