#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "drivers/kit/refusal.h"
#include "drivers/saa_modbus/interpreter.h"
#include "drivers/saa_modbus/operations.h"
#include "drivers/saa_modbus/procedures.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

// One encoder on a Modbus bus: what to ask next. What the replies mean is the Interpreter's.
//
// - After whatever leaves the line unclear it asks for silence for `timeout_us`.
// - While a late reply could be taken for the one to a request (StaleReplyGuard), an encoder up to 16 bits is asked for
//   the other number of registers (SAA manual 5.1.7: "the reading points could be 01 or 02").
// - A reading that failed is asked for once more at once; then in the next slot.
// - An order's exchanges come before live readings: they are few, and their readings are published as well.
// - Where the encoder took on another address or baud rate it follows, until the driver is started again.
class SaaModbusDevice final : public Device {
 public:
  SaaModbusDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& turn) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  [[nodiscard]] Result<> Validate(const DriverCommand& order, MonoNs now) const override;
  void Begin(const DriverCommand& order, MonoNs now) override;
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs now) override;

 private:
  // The procedure that carries out the order, or why it cannot begin now.
  [[nodiscard]] Made<Procedure> Admit(const DriverCommand& order, MonoNs now) const;
  [[nodiscard]] std::optional<Outcome> RefusalNow(const DriverCommand& order, MonoNs now) const;
  [[nodiscard]] Step LiveStep(const BusSlot& turn) const;
  [[nodiscard]] Step CarryOut(const Want& want, const BusSlot& turn) const;
  [[nodiscard]] Step Read(std::uint8_t address, const BusSlot& turn, Priority priority) const;
  [[nodiscard]] Exchange Ask(const Frame& request) const;
  [[nodiscard]] MonoNs Patience() const;
  void OnExchange(const Event& event);
  void OnStray(const Event& event);
  void OnRetuned(MonoNs now);
  void OnLinkUp(MonoNs now);
  void OnLinkDown();
  [[nodiscard]] std::optional<Outcome> RefusalOfWrite(const OperationSpec& operation, MonoNs now) const;
  [[nodiscard]] bool Expired(MonoNs now) const { return !procedure_begun_ && now > begin_by_; }
  void ExpireIfLate(MonoNs now);
  void Report(const Outcome& outcome);
  void CompareWithFile(MonoNs now);

  std::shared_ptr<const DeviceSettings> owned_;  // keeps settings_ alive
  const SaaModbusSettings& settings_;
  const LineFormat line_;  // as the file says
  const bool keeps_line_;  // it asks for silence after stray bytes: one device of a bus does
  const std::vector<std::uint8_t> other_addresses_;
  DeviceOutput& output_;
  Connection connection_;
  const OperationContext around_;  // what procedures work on
  Interpreter interpreter_;

  bool link_up_ = false;
  bool line_unclear_ = false;  // silence before the next request
  bool repeat_ = false;        // the live exchange that failed
  int failures_ = 0;           // live exchanges in a row
  MonoNs not_before_ = 0;      // the silent interval at another rate than the file's
  bool differs_ = false;       // the alarm is up
  Frame sent_;                 // under way
  std::int64_t tuning_to_ = 0;

  std::unique_ptr<Procedure> procedure_;
  CommandId order_{};
  MonoNs begin_by_ = kNever;
  bool procedure_begun_ = false;      // its first request was sent
  bool procedure_in_flight_ = false;  // the exchange under way is the procedure's
  std::optional<MonoNs> last_write_;  // of the encoder's memory
};

}  // namespace axlecast::saa_modbus
