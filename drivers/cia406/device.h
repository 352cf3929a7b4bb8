#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "core/device/device.h"
#include "drivers/cia406/interpreter.h"
#include "drivers/cia406/procedures.h"
#include "drivers/kit/command_runner.h"

namespace axlecast::cia406 {

// One standard encoder on a CAN bus: selects what is sent, and when; otherwise it listens. The Interpreter evaluates the
// frames.
class Cia406Device final : public CommandDevice<Procedure> {
 public:
  Cia406Device(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& slot) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  void Begin(const DriverCommand& command, MonoNs now) override;
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs now) override;

 private:
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override;
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs now) const override;
  [[nodiscard]] bool SyncIsDue(const BusSlot& slot) const;
  // The next transfer, and its priority.
  struct Transfer {
    SdoRequest request;
    Priority priority = Priority::kSlow;
  };
  [[nodiscard]] std::optional<Transfer> NextTransfer(const BusSlot& slot) const;
  // Returns the transfer that the procedure needs next; nothing without a procedure, or if it has expired.
  [[nodiscard]] std::optional<SdoRequest> ProcedureRequest(MonoNs now) const;
  [[nodiscard]] Step Listening(MonoNs now) const;
  void OnLinkDown(MonoNs now);
  void OnNotSent(const Event& event);
  void AdvanceProcedure(const std::optional<SdoResult>& result, MonoNs now);

  const Cia406Settings& settings_;
  const bool produces_sync_;
  Interpreter interpreter_;

  MonoNs hold_until_ = 0;       // the controller's queue is full
  MonoNs sync_at_ = 0;          // of the last SYNC
  bool live_slot_ = false;      // the last slot was the procedure's: a live reading that is due goes first
  bool for_procedure_ = false;  // the request that is being sent is the procedure's
};

}  // namespace axlecast::cia406
