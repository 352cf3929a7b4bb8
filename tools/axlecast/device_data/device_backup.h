#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/family.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/device_data/parameters.h"
#include "tools/monitor/machine_view.h"

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
[[nodiscard]] BackupReading ReadBackup(OperatorClient& client, const Family& family, const CommandOptions& options);

// The contents of a backup's file: as `eeprom backup --out` or `param export` write it. `problem` says what is wrong,
// `note` what is odd.
[[nodiscard]] BackupContents ParseBackup(const Family& family, const std::string& device, const std::string& file,
                                         const std::string& text, std::string& problem, std::string& note);

// "axis1-20261121T070005Z.txt"
[[nodiscard]] std::string BackupFileName(const std::string& device, std::int64_t utime, const std::string& ending);

// The file of `axlecast backup`: everything readable of one device (docs/backup.md). Pure.

inline constexpr int kBackupVersion = 1;
inline constexpr std::size_t kMaxBackupBytes = 4'000'000;

struct DeviceBackup {
  std::string machine = {};
  std::string device = {};
  std::string bus = {};
  std::string family = {};
  std::string model = {};
  std::string written_by = {};  // program and version
  std::int64_t utime = 0;       // us, UNIX time
  std::int64_t identity = -1;   // as device_info_t; -1 not told
  std::string serial = {};
  std::string firmware = {};
  MemoryCells cells = {};
  std::map<std::string, std::string> parameters = {};  // values in their units
  nlohmann::ordered_json datum = nullptr;              // for people; it is the bridge's, not the device's
  nlohmann::ordered_json alarms = nlohmann::ordered_json::array();  // as they stood
};

// Of a device that has its DEVICE message.
[[nodiscard]] DeviceBackup MakeBackup(const MachineView& machine, const DeviceView& device, const Family& family,
                                      const BackupContents& contents);

// A JSON object whose last member is the SHA-256 over all the others: over their compact text, in their order.
[[nodiscard]] std::string ToFileText(const DeviceBackup& backup);

// `problem` says what is wrong and what would help, else it stays empty.
[[nodiscard]] DeviceBackup ParseDeviceBackup(std::string_view text, std::string& problem);

// What it holds for a device of that family. `problem`: of a parameter that the family does not know, or whose value is
// beyond its range.
[[nodiscard]] BackupContents ContentsOf(const DeviceBackup& backup, const Family& family, std::string& problem);

// Why the device is not the one that was backed up; empty when it is, as far as both tell who they are.
[[nodiscard]] std::string OtherUnit(const DeviceBackup& backup, const device_info_t& info);

}  // namespace axlecast
