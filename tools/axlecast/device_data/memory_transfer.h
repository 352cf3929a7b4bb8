#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/command/operator_client.h"

namespace axlecast {

// A device's memory over the bridge. `wish` names the device, validity and reason.

inline constexpr std::size_t kLongestWrite = 16;  // cells

// Those cells of `wanted` that differ from `present` and may be written. The driver knows which addresses the machine's
// file lists: it is asked what it would do.
struct PermittedCells {
  MemoryCells cells;
  std::vector<std::size_t> not_permitted;  // addresses
  std::optional<CommandResult> failed;     // the question that brought no answer; those after it were not asked
};
[[nodiscard]] PermittedCells AskPermitted(OperatorClient& client, const CommandOptions& wish,
                                          const MemoryCells& present, const MemoryCells& wanted);

[[nodiscard]] CommandResult WriteCells(OperatorClient& client, const CommandOptions& wish, const CellRun& run);

}  // namespace axlecast
