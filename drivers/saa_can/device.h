#pragma once

#include <memory>
#include <optional>

#include "core/device/device.h"
#include "drivers/kit/refusal.h"
#include "drivers/saa_can/interpreter.h"
#include "drivers/saa_can/procedures.h"

namespace axlecast::saa_can {

// One encoder of the SAA series on CAN: what is sent to it, and when. What comes of its frames is the Interpreter's.
//
// - Mode cyclic: it is started (01 NN) when the link comes up and once a second while it is silent; then it is listened
//   to. With set_period the rate is set (31 NN TT) before the first start.
// - Mode single: it is asked (80 NN) in each live slot, never before the last request was answered or has timed out.
// - No frame is sent while an earlier one waits for a node to acknowledge it, but for one a second: the controller's
//   queue stays short, and nothing old goes out when the bus comes back.
class SaaCanDevice final : public Device {
 public:
  SaaCanDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output);

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
  [[nodiscard]] MonoNs FreeAt() const;  // another frame may be sent then
  [[nodiscard]] std::optional<Step> ForProcedure(const BusSlot& turn) const;
  [[nodiscard]] std::optional<CanFrame> SetUp(MonoNs now) const;
  [[nodiscard]] MonoNs PollAt() const;
  [[nodiscard]] CanFrame Poll() const;
  [[nodiscard]] Step Hear(const BusSlot& turn) const;
  void OnLink(const Event& event);
  void NoteOwn(const Event& event, MonoNs now);
  void AdvanceProcedure(const Event& event, const Interpreter::Heard& heard, MonoNs now);
  [[nodiscard]] bool Expired(MonoNs now) const { return procedure_ && !procedure_->touched() && now >= begin_by_; }
  void Report(const std::optional<Outcome>& outcome);

  std::shared_ptr<const DeviceSettings> owned_;  // keeps settings_ alive
  const SaaCanSettings& settings_;
  const bool bench_;
  DeviceOutput& output_;
  Interpreter interpreter_;

  bool link_up_ = false;
  bool silenced_ = false;  // after a change of the bit rate
  bool period_to_set_ = false;
  bool to_start_ = false;
  MonoNs sent_at_ = 0;     // the newest own frame was queued
  MonoNs not_before_ = 0;  // after a full queue
  std::unique_ptr<Procedure> procedure_;
  CommandId order_{};
  MonoNs begin_by_ = kNever;
};

}  // namespace axlecast::saa_can
