#pragma once

#include <optional>
#include <variant>

#include "core/device/operation.h"
#include "drivers/saa_can/interpreter.h"

namespace axlecast::saa_can {

// One order being carried out. It sees every event of the bus after the Interpreter. After a final outcome it is not
// used any more.
class Procedure {
 public:
  virtual ~Procedure() = default;

  struct Nothing {};
  struct Position {};  // as soon as the encoder sends one, or is asked for one
  using Want = std::variant<Nothing, Position, CanFrame>;
  [[nodiscard]] virtual Want Wants(MonoNs now) const = 0;
  // It wants to be asked again by then.
  [[nodiscard]] virtual MonoNs Due(MonoNs now) const = 0;

  // The frame that it wanted is about to be handed to the controller.
  virtual void OnStarted([[maybe_unused]] const CanFrame& frame) {}
  // An outcome: progress, or the final one.
  virtual std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) = 0;
  // The link is gone.
  [[nodiscard]] virtual Outcome OnLinkLost() const = 0;

  // It may have changed something in the encoder.
  [[nodiscard]] virtual bool touched() const { return false; }
  // Nothing else may be transmitted meanwhile.
  [[nodiscard]] virtual bool alone() const { return false; }
  // The encoder may run at another bit rate: nothing must be transmitted until the link comes up again.
  [[nodiscard]] virtual bool silences() const { return false; }
};

}  // namespace axlecast::saa_can
