#pragma once

#include <string>

#include "core/config/machine_config.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/command/operator_client.h"
#include "tools/axlecast/device_data/device_backup.h"
#include "tools/axlecast/device_data/restore_report.h"

namespace axlecast {

struct RestoreWish {
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
  RestoreRun(const MachineConfig& machine, RestoreWish wish);

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
  const RestoreWish wish_;
  OperatorClient client_;
  BackupContents wanted_;
  std::vector<CellRun> runs_;  // report_.lines has one for each, before the parameters
  ParameterChanges changes_;
  RestoreReport report_;
};

}  // namespace axlecast
