#pragma once

#include <optional>
#include <string>

#include "core/device/family.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/command/operator_client.h"
#include "tools/axlecast/device_data/parameter_values.h"

namespace axlecast {

// What a device keeps and its family can read: cells of its memory, or parameters.
struct BackupContents {
  MemoryCells cells;
  ParameterValues values;
};

// The operation of the family that reads it; null: it has none.
[[nodiscard]] const OperationSpec* BackupOperation(const Family& family);

// A backup as it was read from a device.
struct BackupReading {
  CommandResult result;
  BackupContents contents;
  std::string text;     // of its file
  std::string problem;  // what was wrong besides the command's outcome
};
[[nodiscard]] BackupReading ReadBackup(OperatorClient& client, const Family& family, const CommandOptions& wish);

// The contents of a backup's file: as `eeprom backup --out` or `param export` write it. `problem` says what is wrong,
// `note` what is odd.
[[nodiscard]] BackupContents ParseBackup(const Family& family, const std::string& device, const std::string& file,
                                         const std::string& text, std::string& problem, std::string& note);

// "axis1-20261121T070005Z.txt"
[[nodiscard]] std::string BackupFileName(const std::string& device, std::int64_t utime, const std::string& ending);

}  // namespace axlecast
