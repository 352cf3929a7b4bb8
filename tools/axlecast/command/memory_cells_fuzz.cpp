#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "tools/axlecast/command/memory_cells.h"

// Any text: the parser must not crash. It returns an error, or cells whose runs contain each of them once.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  const auto parsed = ParseMemoryFile({reinterpret_cast<const char*>(data), size});
  if (!parsed) return 0;
  const MemoryFile& file = *parsed;
  if (file.cells.empty()) std::abort();
  if (!CellRuns(file.cells, file.cells, 16).empty()) std::abort();
  MemoryCells others = file.cells;
  for (auto& [address, byte] : others) byte = static_cast<std::uint8_t>(byte ^ 1U);
  std::size_t cells = 0;
  for (const CellRun& run : CellRuns(file.cells, others, 16)) {
    if (run.after.empty() || run.after.size() > 16 || run.before.size() != run.after.size()) std::abort();
    cells += run.after.size();
  }
  if (cells != file.cells.size()) std::abort();
  return 0;
}
