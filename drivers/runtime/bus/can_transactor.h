#pragma once

#include "core/base/time.h"
#include "core/device/link.h"
#include "drivers/runtime/bus/transactor.h"

namespace axlecast {

// Steps on a CAN bus: Send, Listen and Idle. Frames that come are told in their order, one at each Listen or Idle:
// nothing is read while nobody waits, and nothing overtakes.
class CanTransactor final : public Transactor {
 public:
  CanTransactor(FrameLink& link, const Clock& clock) : link_(link), clock_(clock) {}

  [[nodiscard]] const Event* FindStray() override { return nullptr; }
  [[nodiscard]] const Event* Run(const Step& step, MonoNs by) override;

 private:
  [[nodiscard]] const Event* Transmit(const CanFrame& frame);
  // A frame, or null at `by` or when woken.
  [[nodiscard]] const Event* Hear(MonoNs by);
  [[nodiscard]] const Event* Arrived();
  [[nodiscard]] const Event* Ended(Event::Kind kind, Interval at);

  FrameLink& link_;
  const Clock& clock_;
  FrameLink::Received received_;
  Event event_;
};

}  // namespace axlecast
