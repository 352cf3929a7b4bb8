#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string_view>

#include "core/device/device.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_can/interpreter.h"
#include "drivers/saa_can/procedures.h"

namespace axlecast::saa_can {

// Returns the operations of SAA encoders.
[[nodiscard]] std::span<const OperationSpec> SaaOperations();
// Returns the operations of the family: those of SAA encoders, then those that only cia406 has.
[[nodiscard]] std::span<const OperationSpec> Operations();
// Returns whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);

// One encoder of the SAA series on CAN: selects what is sent to it, and when. The Interpreter evaluates its frames.
//
// - Mode cyclic: it is started (01 NN) when the link comes up, and once a second while it is silent. With set_period, the
//   rate is set (31 NN TT) before the first start.
// - Mode single: it is polled (80 NN) in each live slot, never before the last request was answered or has timed out.
// - While a frame waits for a node to acknowledge it, at most one further frame a second is sent. So the controller's
//   queue stays short, and no old frames are sent when the bus works again.
class SaaCanDevice final : public CommandDevice<Procedure> {
 public:
  SaaCanDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

  [[nodiscard]] Step Next(const BusSlot& slot) const override;
  void OnStarted(const Step& step, MonoNs now) override;
  void On(const Event& event) override;
  void Begin(const DriverCommand& command, MonoNs now) override;

 private:
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override;
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs now) const override;
  [[nodiscard]] Result<> CheckPosition(const DriverCommand& command, const Motion& motion) const override;
  // Returns whether a procedure is carried out during which nothing else may be sent.
  [[nodiscard]] bool ProcedureAlone() const { return runner_.busy() && runner_.procedure().alone(); }
  [[nodiscard]] MonoNs FreeAt() const;  // another frame may be sent then
  [[nodiscard]] std::optional<Step> ForProcedure(const BusSlot& slot) const;
  // Returns whether a frame must be sent to satisfy the need.
  [[nodiscard]] bool NeedsRequest(const Procedure::Need& need) const;
  [[nodiscard]] std::optional<CanFrame> SetUp(MonoNs now) const;
  [[nodiscard]] MonoNs PollAt() const;
  [[nodiscard]] CanFrame Poll() const;
  [[nodiscard]] Step Listening(const BusSlot& slot) const;
  void OnLink(const Event& event);
  void NoteOwn(const Event& event, MonoNs now);
  void Report(const std::optional<Outcome>& outcome);

  const SaaCanSettings& settings_;
  const bool bench_;
  Interpreter interpreter_;

  bool silenced_ = false;  // after a change of the bit rate
  bool period_to_set_ = false;
  bool to_start_ = false;
  MonoNs sent_at_ = 0;     // the newest own frame was queued
  MonoNs not_before_ = 0;  // after a full queue
};

}  // namespace axlecast::saa_can
