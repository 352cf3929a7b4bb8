#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/axlecast/command.h"
#include "core/config/machine_config.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/memory_cells.h"
#include "tools/axlecast/device_data/device_backup.h"
#include "tools/axlecast/device_data/parameters.h"

namespace axlecast {

// The result of `axlecast restore` (docs/backup.md).

// One difference between the device and the backup.
struct RestoreLine {
  enum class State : std::uint8_t { kPending, kDone, kFailed, kImpossible };

  std::string what;  // "eeprom 10-12", or a parameter
  std::string before;
  std::string after;
  State state = State::kPending;
  std::string text;  // why it failed or is impossible
};

struct RestoreReport {
  std::string device;
  std::string file;
  std::string other_unit;          // how its identity differs from the backup, or empty
  std::vector<RestoreLine> lines;  // the differences
  std::vector<std::string> kept;   // contents of the file that cannot be written, with the reason
  bool compared = false;           // false if the backup was refused
  bool dry_run = false;
  std::optional<bool> reads_back;  // after writing: all writable values are as in the backup
};

[[nodiscard]] RestoreLine LineOf(const CellRun& run);
[[nodiscard]] RestoreLine LineOf(const ParameterChange& change);

// Stores the outcome of a command in one of its lines.
void Settle(RestoreLine& line, const CommandResult& result);

[[nodiscard]] std::string ToText(const RestoreReport& report);
[[nodiscard]] nlohmann::ordered_json ToJson(const RestoreReport& report);

struct RestoreOptions {
  CommandOptions command;  // device, key, validity, reason, yes
  std::string file;
  bool dry_run = false;
  bool to_another_unit = false;
};

// Restores a device from a backup: compares, shows the differences, asks, writes them and reads back. It can be repeated
// after an interruption: values that were written no longer differ.
class RestoreRun {
 public:
  // The machine must contain the device.
  RestoreRun(const MachineConfig& machine, RestoreOptions options);

  // Returns the exit code. Reports on standard error.
  [[nodiscard]] int Run(const DeviceBackup& backup, const device_info_t& info);
  [[nodiscard]] const RestoreReport& report() const { return report_; }

 private:
  [[nodiscard]] int Refuse(const std::string& problem, int exit_code) const;
  [[nodiscard]] int CheckUnit(const DeviceBackup& backup, const device_info_t& info);
  // Reads the present contents of the device. Returns an exit code.
  [[nodiscard]] int Read(BackupContents& present);
  [[nodiscard]] int Compare(const BackupContents& present);
  void ListKept(const DeviceBackup& backup);
  [[nodiscard]] bool AnyPending() const;
  [[nodiscard]] int Write();
  [[nodiscard]] int WriteMemory();
  [[nodiscard]] int WriteValues();
  [[nodiscard]] int ReadBack();

  const Family& family_;
  const RestoreOptions options_;
  OperatorClient client_;
  BackupContents wanted_;
  std::vector<CellRun> runs_;  // report_.lines has one for each, before the parameters
  ParameterChanges changes_;
  RestoreReport report_;
};

}  // namespace axlecast
