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

// Reads and writes of a device's memory and parameters through the bridge. `options` contains the device, validity and
// reason.

inline constexpr std::size_t kMaxWrite = 16;  // cells

struct PermittedCells {
  MemoryCells cells;
  std::vector<std::size_t> not_permitted;  // addresses
  std::optional<CommandResult> failed;     // the first query without an answer; later cells were not queried
};
// Returns the cells of `wanted` that differ from `present` and may be written. The driver knows the addresses that the
// machine's file lists: each cell is queried with PREPARE.
[[nodiscard]] PermittedCells QueryPermitted(OperatorClient& client, const CommandOptions& options,
                                            const MemoryCells& present, const MemoryCells& wanted);

[[nodiscard]] CommandResult WriteCells(OperatorClient& client, const CommandOptions& options, const CellRun& run);

struct ParameterReading {
  CommandResult result;
  Result<ParameterValues> values;  // empty if the command failed; an error if its answer is malformed
};
[[nodiscard]] ParameterReading ReadParameters(OperatorClient& client, const Family& family,
                                              const CommandOptions& options);

// Writes up to 16 parameters per command. Stops at the first command that is not verified.
[[nodiscard]] std::vector<CommandResult> WriteParameters(OperatorClient& client, const CommandOptions& options,
                                                         const ParameterChanges& changes);

// Returns the commands of a write.
[[nodiscard]] std::vector<CommandRequest> WriteRequests(const CommandOptions& options,
                                                        const ParameterChanges& changes);

// Returns true if the command was executed, whether or not the device allows a read-back.
[[nodiscard]] bool IsDone(const CommandResult& result);
// Prints the outcome to standard error. Returns its exit code.
[[nodiscard]] int PrintOutcome(const CommandResult& result);

struct DeviceRead {
  std::string operation;
  CommandResult result;
};
// Runs each read of the family that needs no argument: memory, parameters, identity.
[[nodiscard]] std::vector<DeviceRead> ReadEverything(OperatorClient& client, const BusConfig& bus,
                                                     const std::string& device);

// Returns one line per value, and one per failed read.
[[nodiscard]] FindingGroup ReadFindings(const BusConfig& bus, const std::vector<DeviceRead>& reads);

}  // namespace axlecast
