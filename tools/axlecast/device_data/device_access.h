#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/family.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/device_data/parameters.h"
#include "tools/service/acceptance_result.h"

namespace axlecast {

// A device's memory over the bridge. `options` names the device, validity and reason.

inline constexpr std::size_t kLongestWrite = 16;  // cells

// Those cells of `wanted` that differ from `present` and may be written. The driver knows which addresses the machine's
// file lists: it is asked what it would do.
struct PermittedCells {
  MemoryCells cells;
  std::vector<std::size_t> not_permitted;  // addresses
  std::optional<CommandResult> failed;     // the question that brought no answer; those after it were not asked
};
[[nodiscard]] PermittedCells AskPermitted(OperatorClient& client, const CommandOptions& options,
                                          const MemoryCells& present, const MemoryCells& wanted);

[[nodiscard]] CommandResult WriteCells(OperatorClient& client, const CommandOptions& options, const CellRun& run);

// A device's parameters over the bridge. `options` names the device, validity and reason.

struct ParameterReading {
  ParameterValues values;  // empty when it failed
  CommandResult result;    // of the command
  std::string problem;     // what was wrong besides the command's outcome
};
[[nodiscard]] ParameterReading ReadParameters(OperatorClient& client, const Family& family,
                                              const CommandOptions& options);

// One command for at most 16 of them; ends with the first that is not verified.
[[nodiscard]] std::vector<CommandResult> WriteParameters(OperatorClient& client, const CommandOptions& options,
                                                         const ParameterChanges& changes);

// The commands of a write, each as far as an argument list goes.
[[nodiscard]] std::vector<CommandRequest> WriteRequests(const CommandOptions& options,
                                                        const ParameterChanges& changes);

// Everything of a device that can be read without an argument and changes nothing: its memory, parameters, identity.

struct DeviceRead {
  std::string operation;
  CommandResult result;
};
[[nodiscard]] std::vector<DeviceRead> ReadEverything(OperatorClient& client, const BusConfig& bus,
                                                     const std::string& device);

// One line for each value that was read, and for each read that was not possible.
[[nodiscard]] FindingGroup ReadFindings(const BusConfig& bus, const std::vector<DeviceRead>& reads);

}  // namespace axlecast
