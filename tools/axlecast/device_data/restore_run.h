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

// What `axlecast restore` does and has done (docs/backup.md). Pure.

// One thing in which the device differs from the backup.
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
  std::string other_unit;          // why it is another unit than the one that was backed up; empty: it is not
  std::vector<RestoreLine> lines;  // what differs
  std::vector<std::string> kept;   // what the file holds and nobody can write back, with the reason
  bool compared = false;           // else it was refused before
  bool dry_run = false;
  std::optional<bool> reads_back;  // after writing: all that could be written reads as in the backup
};

[[nodiscard]] RestoreLine LineOf(const CellRun& run);
[[nodiscard]] RestoreLine LineOf(const ParameterChange& change);

// What a command made of the lines that it was about.
void Settle(RestoreLine& line, const CommandResult& result);

[[nodiscard]] std::string ToText(const RestoreReport& report);
[[nodiscard]] nlohmann::ordered_json ToJson(const RestoreReport& report);

struct RestoreOptions {
  CommandOptions command;  // device, key, validity, reason, yes
  std::string file;
  bool dry_run = false;
  bool to_another_unit = false;
};

// Gives a device back what a backup holds of it: compares, shows, asks, writes what differs, reads back. Interrupted, it
// can be repeated: what was written differs no more.
class RestoreRun {
 public:
  // The machine has the device.
  RestoreRun(const MachineConfig& machine, RestoreOptions options);

  // The exit code. Tells on standard error what it sees.
  [[nodiscard]] int Run(const DeviceBackup& backup, const device_info_t& info);
  [[nodiscard]] const RestoreReport& report() const { return report_; }

 private:
  [[nodiscard]] int Refuse(const std::string& problem, int exit_code) const;
  [[nodiscard]] int CheckUnit(const DeviceBackup& backup, const device_info_t& info);
  // What the device holds now; the exit code says why there is nothing.
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
