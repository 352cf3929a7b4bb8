#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "tools/axlecast/device_data/replace_backup.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

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
