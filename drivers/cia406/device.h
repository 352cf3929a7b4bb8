#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "core/device/device.h"
#include "drivers/cia406/interpreter.h"
#include "drivers/cia406/procedures.h"
#include "drivers/kit/refusal.h"

namespace axlecast::cia406 {

// One standard encoder on a CAN bus: when to send, and what; else it listens. What comes of it is the
// Interpreter's.
class Cia406Device final : public Device {
 public:
  Cia406Device(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

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
  [[nodiscard]] bool SyncIsDue(const BusSlot& turn) const;
  // The transfer that is wanted now, and how urgently.
  struct Transfer {
    SdoRequest request;
    Priority priority = Priority::kSlow;
  };
  [[nodiscard]] std::optional<Transfer> NextTransfer(const BusSlot& turn) const;
  [[nodiscard]] std::optional<SdoRequest> Ordered(MonoNs now) const;
  [[nodiscard]] Step Listening(MonoNs now) const;
  void OnLinkDown(MonoNs now);
  void OnNotSent(const Event& event);
  void AdvanceProcedure(const std::optional<SdoResult>& result, MonoNs now);
  [[nodiscard]] bool Expired(MonoNs now) const { return procedure_ && !procedure_->touched() && now >= begin_by_; }
  void Report(const std::optional<Outcome>& outcome);

  std::shared_ptr<const DeviceSettings> owned_;  // keeps settings_ alive
  const Cia406Settings& settings_;
  const bool produces_sync_;
  DeviceOutput& output_;
  Interpreter interpreter_;

  bool link_up_ = false;
  MonoNs hold_until_ = 0;  // the controller's queue is full
  MonoNs sync_at_ = 0;     // of the last SYNC
  std::unique_ptr<Procedure> procedure_;
  CommandId order_{};
  MonoNs begin_by_ = kNever;
  bool live_turn_ = false;  // the procedure had its turn: a live reading that is due goes first
  bool for_order_ = false;  // the request that is going out is the procedure's
};

}  // namespace axlecast::cia406
