#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/config/machine_config.h"
#include "core/device/family.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/device_data/parameters.h"
#include "tools/monitor/machine_view.h"
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

// ---- backup ----

// The stored data of a device that its family can read: cells of its memory, or parameters.
struct BackupContents {
  MemoryCells cells;
  ParameterValues values;
};

// Returns the operation of the family that reads the contents, or null.
[[nodiscard]] const OperationSpec* BackupOperation(const Family& family);

struct BackupReading {
  CommandResult result;
  Result<BackupContents> contents;  // empty if the command failed; an error if its answer is malformed
  std::string text;                 // for the file that ParseContents reads
};
// Reads the contents from a device. Its family must have a BackupOperation.
[[nodiscard]] BackupReading ReadContents(OperatorClient& client, const Family& family,
                                         const CommandOptions& options);

// Returns kExitDone if the contents were read. Otherwise prints the error after `prefix`, and returns the exit code.
[[nodiscard]] int CheckReading(const BackupReading& reading, const std::string& prefix);

struct ContentsFile {
  BackupContents contents;
  std::string device;  // whose contents these are, if the file of a memory states it
};
// Parses a file that `eeprom backup --out`, `param export` or `replace` wrote. `file`: its name, for errors.
[[nodiscard]] Result<ContentsFile> ParseContents(const Family& family, const std::string& file,
                                                 const std::string& text);

// "axis1-20261121T070005Z.txt"
[[nodiscard]] std::string BackupFileName(const std::string& device, std::int64_t unix_us,
                                         const std::string& ending);

// The file of `axlecast backup`: everything readable of one device (docs/backup.md).

inline constexpr int kBackupVersion = 1;
inline constexpr std::size_t kMaxBackupBytes = 4'000'000;

struct DeviceBackup {
  std::string machine = {};
  std::string device = {};
  std::string bus = {};
  std::string family = {};
  std::string model = {};
  std::string written_by = {};  // program and version
  std::int64_t unix_us = 0;     // time of the backup
  std::int64_t identity = -1;   // as in device_info_t; -1: unknown
  std::string serial = {};
  std::string firmware = {};
  MemoryCells cells = {};
  std::map<std::string, std::string> parameters = {};  // values in their units
  nlohmann::ordered_json datum = nullptr;              // for information: the bridge stores it, not the device
  nlohmann::ordered_json alarms = nlohmann::ordered_json::array();  // at the time of the backup
};

// Returns the backup of a device. Its DEVICE message must have been received.
[[nodiscard]] DeviceBackup MakeBackup(const MachineView& machine, const DeviceView& device, const Family& family,
                                      const BackupContents& contents);

// Formats a JSON object. Its last member is the SHA-256 of the compact text of all others, in their order.
[[nodiscard]] std::string ToFileText(const DeviceBackup& backup);

[[nodiscard]] Result<DeviceBackup> ParseDeviceBackup(std::string_view text);

// Returns the contents for a device of `family`. Fails if a parameter is unknown or its value out of range.
[[nodiscard]] Result<BackupContents> ContentsOf(const DeviceBackup& backup, const Family& family);

// Returns how the identity of the device differs from the backup. Returns an empty text if it is the same device, as far as
// both are known.
[[nodiscard]] std::string OtherUnit(const DeviceBackup& backup, const device_info_t& info);

}  // namespace axlecast
