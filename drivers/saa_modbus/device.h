#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_modbus/interpreter.h"
#include "drivers/saa_modbus/operations.h"
#include "drivers/saa_modbus/procedures.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

// One encoder on a Modbus bus. Selects the next request; the Interpreter evaluates the replies.
//
// - After an unclear exchange, the line must be idle for `timeout_us` first.
// - While a late reply could be taken for the one to a request (StaleReplyGuard), an encoder up to 16 bits is asked for
//   the other number of registers (SAA manual 5.1.7: "the reading points could be 01 or 02").
// - A reading that failed is asked for once more at once; then in the next slot.
// - A command's exchanges come before live readings: they are few, and their readings are published as well.
// - It follows a change of the encoder's address or baud rate until the driver is restarted.
class SaaModbusDevice final : public Device, private CommandRunner<Procedure>::Policy {
 public:
  SaaModbusDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& slot) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  [[nodiscard]] Result<> Validate(const DriverCommand& command, MonoNs now) const override {
    return runner_.Validate(command, link_up_, now);
  }
  void Begin(const DriverCommand& command, MonoNs now) override { runner_.Begin(command, link_up_, now); }
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs) override { return runner_.Cancel(id); }

 private:
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override;
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs now) const override;
  [[nodiscard]] Step LiveStep(const BusSlot& slot) const;
  [[nodiscard]] Step CarryOut(const ProcedureStep& step, const BusSlot& slot) const;
  [[nodiscard]] Step Read(std::uint8_t address, const BusSlot& slot, Priority priority) const;
  [[nodiscard]] Exchange ExchangeOf(const Frame& request) const;
  [[nodiscard]] MonoNs Timeout() const;
  void OnExchange(const Event& event);
  void OnUnexpectedBytes(const Event& event);
  void OnBaudRateSet(MonoNs now);
  void OnLinkUp(MonoNs now);
  void OnLinkDown();
  void CompareWithFile(MonoNs now);

  std::shared_ptr<const DeviceSettings> owned_;  // keeps settings_ alive
  const SaaModbusSettings& settings_;
  const LineFormat line_;  // as configured
  const bool keeps_line_;  // it waits for an idle line after unexpected bytes: one device of a bus does
  const std::vector<std::uint8_t> other_addresses_;
  DeviceOutput& output_;
  Connection connection_;
  const OperationContext context_;
  Interpreter interpreter_;

  bool link_up_ = false;
  bool line_unclear_ = false;   // silence before the next request
  bool repeat_ = false;         // the live exchange that failed
  int failures_ = 0;            // live exchanges in a row
  MonoNs not_before_ = 0;       // the silent interval at another rate than the file's
  bool differs_ = false;        // the alarm is up
  Frame sent_;                  // under way
  std::int64_t next_baud_ = 0;  // of the SetBaudRate under way

  std::optional<MonoNs> last_write_;  // of the encoder's memory
  CommandRunner<Procedure> runner_;
};

}  // namespace axlecast::saa_modbus
