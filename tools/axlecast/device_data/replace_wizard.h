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

// Detects from the state of a device that it was disconnected, and that it or another one answers again.
class ExchangeWatch {
 public:
  enum class Stage : std::uint8_t { kThere, kAway, kBack };

  static constexpr MonoNs kSteady =
      kSecond;  // minimum time of answers without a gap before the device counts as back

  // `state`: device_info_t STATE_*, or nothing if its driver is silent. `boot_id`: of its driver, 0 if unknown. A restart of
  // the driver counts as a disconnection.
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
  std::string backup;  // file: read if it exists, else written; empty: a generated name
  std::string value;   // value of the axis after the exchange; empty: ask, or set no datum with `yes`
};

// Guides an operator through the exchange of a device. Each step is confirmed and can be repeated. Reports on standard
// error.
class ReplaceWizard {
 public:
  // The machine must contain the device.
  ReplaceWizard(const MachineConfig& machine, ReplaceOptions options);

  [[nodiscard]] int Run();  // returns the exit code
  [[nodiscard]] const ReplaceReport& report() const { return report_; }

 private:
  using End = std::optional<int>;  // exit code of a step that stops; empty: continue with the next step

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
  // Returns the device after its messages were received, at most after a few seconds.
  [[nodiscard]] DeviceView Look();
  [[nodiscard]] CommandRequest Request(const char* operation) const;
  [[nodiscard]] bool Agreed() const;  // --yes, or the operator confirms

  const MachineConfig& machine_;
  const Family& family_;
  const ReplaceOptions options_;
  SystemClock clock_;
  OperatorClient client_;
  ReplaceReport report_;
  std::optional<BackupContents> backup_;
};

}  // namespace axlecast
