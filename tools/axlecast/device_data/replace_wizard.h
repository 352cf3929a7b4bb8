#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "platform/os/system_clock.h"
#include "tools/axlecast/command/command_run.h"
#include "tools/axlecast/device_data/device_backup.h"
#include "tools/axlecast/device_data/replace_report.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// Sees from its state when a device was taken away and another, or the same, answers in its place. Pure.
class ExchangeWatch {
 public:
  enum class Stage : std::uint8_t { kThere, kAway, kBack };

  static constexpr MonoNs kSteady = kSecond;  // it answers for so long without a break: back

  // `state`: device_info_t STATE_*, nothing while its driver is silent. `boot_id` of its driver, 0 unknown: one that
  // restarted may have seen it away.
  void On(std::optional<std::int8_t> state, std::int64_t boot_id, MonoNs now);

  [[nodiscard]] Stage stage() const { return stage_; }

 private:
  Stage stage_ = Stage::kThere;
  std::int64_t boot_id_ = 0;
  MonoNs answers_since_ = kNever;
};

struct ReplaceOptions {
  CommandOptions command;  // device, key, validity, reason, yes
  ReplaceStep from = ReplaceStep::kBackup;
  std::string backup;  // file: the backup when it exists, else where it is written; empty: a name of its own
  std::string value;   // what the axis reads after the exchange; empty: ask, with `yes` none
};

// Leads a person through the exchange of a device: one step after the other, each asked for and each safe to repeat.
// Tells on standard error what it sees.
class ReplaceWizard {
 public:
  // The machine has the device.
  ReplaceWizard(const MachineConfig& machine, ReplaceOptions options);

  [[nodiscard]] int Run();  // the exit code
  [[nodiscard]] const ReplaceReport& report() const { return report_; }

 private:
  using End = std::optional<int>;  // the exit code with which a step stops; nothing: on to the next

  [[nodiscard]] End Backup();
  [[nodiscard]] End Exchange();
  [[nodiscard]] End Accept();
  [[nodiscard]] End WriteBack();
  [[nodiscard]] End SetDatum();

  [[nodiscard]] End LoadBackup();
  [[nodiscard]] End ReadBackup();
  void ShowKnown();
  [[nodiscard]] End WriteCells();
  [[nodiscard]] End WriteRun(const CellRun& run);
  [[nodiscard]] End WriteValues();
  [[nodiscard]] std::string AskValue() const;
  // The device as its messages show it, after at most a few seconds.
  [[nodiscard]] DeviceView Look();
  [[nodiscard]] CommandRequest Request(const char* operation) const;
  [[nodiscard]] bool Agreed() const;  // --yes, or the person says so

  const MachineConfig& machine_;
  const Family& family_;
  const ReplaceOptions options_;
  SystemClock clock_;
  OperatorClient client_;
  ReplaceReport report_;
  std::optional<BackupContents> backup_;
};

}  // namespace axlecast
