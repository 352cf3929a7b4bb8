#pragma once

#include "core/device/step.h"

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

}  // namespace axlecast
