#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "tools/axlecast/command/memory_cells.h"

// Whatever a backup's file holds: it is refused with a line, or its cells come back from what they make of themselves.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace axlecast;
  const MemoryFile file = ParseMemoryFile({reinterpret_cast<const char*>(data), size});
  if (file.cells.empty() && file.problem.empty()) std::abort();
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
