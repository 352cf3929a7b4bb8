#pragma once

#include <optional>

#include "core/device/operation.h"
#include "core/device/step.h"
#include "drivers/tformat/answer.h"

namespace axlecast::tformat {

// One order being carried out, step by step. After a final outcome it is not used any more.
class Procedure {
 public:
  virtual ~Procedure() = default;

  // What it wants to transmit now, or Idle until when it waits.
  [[nodiscard]] virtual Step Next(MonoNs now) const = 0;
  // The exchange that Next returned is about to go on the wire. The outcome when this ends the procedure.
  virtual std::optional<Outcome> OnStarted(Bytes request, MonoNs now) = 0;
  // The exchange is over at `end`. An outcome: progress, or the final one.
  virtual std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) = 0;
  // The link is gone.
  [[nodiscard]] virtual Outcome OnLinkLost() const = 0;

  // Nothing else may be asked of the encoder now.
  [[nodiscard]] virtual bool exclusive() const { return false; }
  // It may have changed something in the encoder.
  [[nodiscard]] virtual bool touched() const { return false; }
};

// A step of a procedure.
[[nodiscard]] inline Step CommandStep(const Exchange& exchange) {
  return {.action = exchange, .priority = Priority::kCommand};
}
[[nodiscard]] inline Step WaitUntil(MonoNs until) {
  return {.action = Idle{until}, .priority = Priority::kCommand};
}

}  // namespace axlecast::tformat
