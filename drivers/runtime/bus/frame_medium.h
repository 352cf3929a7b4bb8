#pragma once

#include "drivers/runtime/bus/medium.h"
#include "drivers/runtime/core/clock.h"
#include "drivers/runtime/core/frame_link.h"

namespace axlecast {

// Steps on a CAN bus: Send, Listen and Idle. Frames that come are told in their order, one at each Listen or Idle:
// nothing is read while nobody waits, and nothing overtakes.
class FrameMedium final : public Medium {
 public:
  FrameMedium(FrameLink& link, const Clock& clock) : link_(link), clock_(clock) {}

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
