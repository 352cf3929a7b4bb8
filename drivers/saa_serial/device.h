#pragma once

#include <memory>
#include <optional>

#include "core/device/device.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_serial/interpreter.h"
#include "drivers/saa_serial/procedure.h"

namespace axlecast::saa_serial {

// One encoder of the SAA series on an asynchronous line: when to listen, to pulse or to ask. What comes of it is the
// Interpreter's.
//
// - Mode timing: it listens all the time, and transmits nothing but a pulse on CLR.
// - Modes handshake and bus: one exchange in each live slot. A reading that failed is not repeated; whatever leaves
//   the line unclear is followed by silence, so that a late reply meets no other request.
class SaaDevice final : public Device, private CommandRunner<Procedure>::Policy {
 public:
  SaaDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& turn) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  [[nodiscard]] Result<> Validate(const DriverCommand& command, MonoNs now) const override {
    return runner_.Validate(command, link_up_, now);
  }
  void Begin(const DriverCommand& command, MonoNs now) override;
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs) override { return runner_.Cancel(id); }

 private:
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override;
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs now) const override;
  [[nodiscard]] Step Stream(const BusSlot& turn) const;
  [[nodiscard]] Step Poll(const BusSlot& turn, Procedure::Want want) const;
  [[nodiscard]] Exchange AskPosition() const;
  [[nodiscard]] Step ZeroStep() const;
  void OnLinkDown(MonoNs now);
  void AdvanceProcedure(const Event& event);

  std::shared_ptr<const DeviceSettings> owned_;  // keeps settings_ alive
  std::shared_ptr<const FamilyBus> owned_bus_;   // and bus_
  const SaaBus& bus_;
  const SaaSettings& settings_;
  const LineFormat line_;
  DeviceOutput& output_;
  Interpreter interpreter_;

  bool link_up_ = false;
  CommandRunner<Procedure> runner_;
  bool zeroing_ = false;    // the request to clear to zero is under way
  bool live_slot_ = false;  // the last slot was the procedure's: a live reading that is due goes first
};

}  // namespace axlecast::saa_serial
