#pragma once

#include <functional>
#include "core/base/time.h"
#include "core/device/link.h"
#include "core/device/probe.h"
#include "core/device/step.h"
#include "drivers/runtime/bus/stale_reply_guard.h"

namespace axlecast {

// Executes one step at a time on a link, and returns the event that ended it, with its timestamps. Allocates nothing.
//
// An event, including its spans, is valid until the next call. Null: nothing happened.
class Transactor {
 public:
  virtual ~Transactor() = default;

  // Returns kUnexpectedBytes if bytes have come without a request, or kLinkDown. Called before every exchange.
  [[nodiscard]] virtual const Event* FindStray() = 0;

  // Executes the step, which must outlive the event. Idle and Listen return null at `by`, or when woken. A step that this
  // kind of bus does not support ends as kLinkDown.
  [[nodiscard]] virtual const Event* Run(const Step& step, MonoNs by) = 0;
};

// Executes steps on a CAN bus: Send, Listen and Idle. Each Listen or Idle returns the next received frame, in order.
class CanTransactor final : public Transactor {
 public:
  CanTransactor(FrameLink& link, const Clock& clock) : link_(link), clock_(clock) {}

  [[nodiscard]] const Event* FindStray() override { return nullptr; }
  [[nodiscard]] const Event* Run(const Step& step, MonoNs by) override;

 private:
  [[nodiscard]] const Event* Transmit(const CanFrame& frame);
  // Returns a frame, or null at `by` or when woken.
  [[nodiscard]] const Event* Receive(MonoNs by);
  [[nodiscard]] const Event* Arrived();
  [[nodiscard]] const Event* Ended(Event::Kind kind, Interval at);

  FrameLink& link_;
  const Clock& clock_;
  FrameLink::Received received_;
  Event event_;
};

// Executes the steps of a probe until the probe has ended or `stop`, which is called before every step, returns true.
// Returns false if the link is lost. `guard` has one device and outlives all probes of one line. It delays a request while
// a late reply to an earlier request could look like its reply.
[[nodiscard]] bool RunProbe(Probe& probe, Transactor& transactor, const Clock& clock, StaleReplyGuard& guard,
                            const std::function<bool()>& stop);

}  // namespace axlecast
