#include "drivers/tsubaki_sc/motor_stop.h"

#include <axlecast/command_status_t.hpp>

#include "drivers/runtime/device/outcome_text.h"

namespace axlecast::tsubaki_sc {

using Reason = command_status_t;

Exchange MotorStop::Next() const {
  return verifying_ ? requests_.Read(kStopCoil) : requests_.SetCoil(kStopCoilAddress);
}

std::optional<Outcome> MotorStop::OnAnswer(const Answer& answer) {
  return verifying_ ? OnCoil(answer) : OnWritten(answer);
}

std::optional<Outcome> MotorStop::OnWritten(const Answer& answer) {
  if (answer.refused()) {
    return Final(OrderState::kFailed, Reason::REASON_DEVICE_REFUSED,
                 "the unit refused the stop: " + CauseOf(answer) + "; stop the motor by other means");
  }
  ++writes_;
  verifying_ = answer.ok() || writes_ >= kTries;
  return std::nullopt;
}

std::optional<Outcome> MotorStop::OnCoil(const Answer& answer) {
  if (!answer.ok()) {
    if (!answer.refused() && ++failures_ < kTries) return std::nullopt;
    return GiveUp(ReasonOf(answer), CauseOf(answer));
  }
  if (answer.reply.Bit(0)) {
    Outcome outcome = Verified("the stop coil reads 1; whether the motor stands cannot be read, look at the power");
    outcome.changes.push_back({"stop_coil", "", "1"});
    return outcome;
  }
  verifying_ = false;
  if (writes_ < kTries) return std::nullopt;
  return Final(OrderState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
               Text("the stop coil reads 0 after %d stops: stop the motor by other means", writes_));
}

Outcome MotorStop::GiveUp(std::int32_t reason, const std::string& cause) const {
  if (!sent_) return Final(OrderState::kFailed, reason, "the stop was not sent: " + cause);
  return Final(
      OrderState::kIndeterminate, reason,
      "the stop was sent, but the stop coil could not be read: " + cause + "; stop the motor by other means");
}

}  // namespace axlecast::tsubaki_sc
