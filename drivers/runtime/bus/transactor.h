#pragma once

#include <functional>
#include "core/base/time.h"
#include "core/device/link.h"
#include "core/device/probe.h"
#include "core/device/step.h"
#include "drivers/runtime/bus/stale_reply_guard.h"

namespace axlecast {

// Carries out one step at a time on a link and says what happened, with its instants. Allocates nothing.
//
// Every event stays valid, spans included, until the next call; null: nothing happened.
class Transactor {
 public:
  virtual ~Transactor() = default;

  // Bytes that nobody asked for and that have come by now: kUnexpectedBytes; or kLinkDown. Before every exchange.
  [[nodiscard]] virtual const Event* FindStray() = 0;

  // Carries out the step, which must outlive the event. Idle and Listen return at `by` at the latest, or when woken:
  // null. A step that this kind of bus does not have ends as kLinkDown.
  [[nodiscard]] virtual const Event* Run(const Step& step, MonoNs by) = 0;
};

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

// Carries the probe's steps out until the probe is through, the link is lost (false), or `stop` returns true, which is called
// before every step. `guard` outlives all probes of one line, and has one device. While the reply to an earlier request may
// still come, no request is sent whose reply looks like it: the probe waits.
[[nodiscard]] bool RunProbe(Probe& probe, Transactor& medium, const Clock& clock, StaleReplyGuard& guard,
                            const std::function<bool()>& stop);

}  // namespace axlecast
