#pragma once

#include <memory>
#include <optional>

#include "core/config/machine_config.h"
#include "core/device/device.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tformat/interpreter.h"
#include "drivers/tformat/operations.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

// One encoder on T-format. Selects the next request; the Interpreter evaluates the replies.
//
// - The first request is ID 3: after a start, after the link came up, after the encoder was gone, and after an unfinished
//   reset sequence. Therefore nine requests of an earlier process are never completed by a tenth.
// - While a late reply could be mistaken for the reply to a request (StaleReplyGuard), ID 0 is requested, which also
//   contains the position. If ID 0 may not be requested either, or the encoder is silent, ID 2 tests whether it answers.
//   After the start of the process, the test reads an EEPROM cell that differs from start to start.
// - Nothing is transmitted while the encoder may transmit: after an unclear exchange, the line must be idle first.
// - A reading that failed is repeated once at once, then in the next slot.
class TFormatDevice final : public CommandDevice<Procedure> {
 public:
  TFormatDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& slot) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  void Begin(const DriverCommand& command, MonoNs now) override;
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs now) override;

 private:
  [[nodiscard]] Step PlannedStep(const BusSlot& slot) const;
  [[nodiscard]] Step OtherStep(const BusSlot& slot) const;
  [[nodiscard]] Step WatchStep(const BusSlot& slot) const;
  [[nodiscard]] Step LiveStep(const BusSlot& slot) const;
  [[nodiscard]] DataId PlannedId() const;
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override;
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs now) const override;
  void OnExchange(const Event& event);
  void OnLiveAnswer(const Answer& answer, MonoNs end);
  void OnLinkUp(MonoNs now);
  void OnLinkDown();
  void Report(const std::optional<Outcome>& outcome);

  const TFormatSettings& settings_;
  Interpreter interpreter_;

  bool line_unclear_ = false;     // silence before the next request
  bool all_first_ = true;         // ID 3 before anything else
  int failures_ = 0;              // live exchanges in a row
  std::optional<DataId> sent_;    // under way
  std::optional<DataId> repeat_;  // of the live exchange that failed
  MonoNs not_before_ = 0;         // of a live exchange outside its slot
  int since_all_ = 0;             // readings since the last ID 3
  int silent_ = 0;                // exchanges in a row without a byte
  MonoNs watch_again_ = 0;        // of looking whether it answers
  std::uint8_t fresh_cell_ = 0;   // hardly one that an earlier process has asked for

  bool live_slot_ = false;  // the last slot was the procedure's: a live reading that is due goes first
};

}  // namespace axlecast::tformat
