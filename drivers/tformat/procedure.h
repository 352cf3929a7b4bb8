#pragma once

#include <optional>

#include "core/device/operation.h"
#include "core/device/step.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tformat/answer.h"

namespace axlecast::tformat {

// One command being carried out, exchange by exchange.
class Procedure : public CommandProcedure {
 public:
  // Returns the exchange to transmit now, or Idle until the next one is due.
  [[nodiscard]] virtual Step Next(MonoNs now) const = 0;
  // The exchange that Next returned is about to be transmitted. Returns the final outcome if this ends the procedure.
  virtual std::optional<Outcome> OnStarted(Bytes request, MonoNs now) = 0;
  // The exchange ended at `end`. Returns an outcome, final or not, if there is one to report.
  virtual std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) = 0;
  // Returns whether the encoder must receive no other request now.
  [[nodiscard]] virtual bool exclusive() const { return false; }
};

// A step of a procedure.
[[nodiscard]] inline Step CommandStep(const Exchange& exchange) {
  return {.action = exchange, .priority = Priority::kCommand};
}
[[nodiscard]] inline Step WaitUntil(MonoNs until) {
  return {.action = Idle{until}, .priority = Priority::kCommand};
}

}  // namespace axlecast::tformat
