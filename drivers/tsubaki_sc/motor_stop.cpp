#include "drivers/tsubaki_sc/motor_stop.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast::tsubaki_sc {

using Reason = command_status_t;

Exchange MotorStop::Next() const {
  return verifying_ ? requests_.Read(kStopCoil) : requests_.SetCoil(kStopCoilAddress);
}

std::optional<Outcome> MotorStop::OnAnswer(const Answer& answer) {
  if (begun_at_ == kNever) begun_at_ = answer.end;
  return verifying_ ? OnCoil(answer) : OnWritten(answer);
}

// After some stops without an answer the coil is read all the same: one of them may have arrived.
std::optional<Outcome> MotorStop::OnWritten(const Answer& answer) {
  if (answer.refused()) {
    return Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
                 "the unit refused the stop: " + CauseOf(answer) + "; stop the motor by other means");
  }
  ++writes_;
  seen_off_ = false;
  unanswered_ = answer.ok() ? 0 : unanswered_ + 1;
  verifying_ = unanswered_ == 0 || unanswered_ >= kTries;
  if (!IsOver(answer.end) || verifying_) return std::nullopt;
  return Repeat(answer);
}

std::optional<Outcome> MotorStop::OnCoil(const Answer& answer) {
  if (!answer.ok()) return Repeat(answer);
  if (answer.reply.Bit(0)) {
    Outcome outcome = Verified("the stop coil reads 1; whether the motor stands cannot be read, look at the power");
    outcome.changes.push_back({"stop_coil", "", "1"});
    return outcome;
  }
  seen_off_ = true;
  return Repeat(answer);
}

std::optional<Outcome> MotorStop::OnFenceFailed(const Answer& answer) {
  if (begun_at_ == kNever) begun_at_ = answer.end;
  return Repeat(answer);
}

std::optional<Outcome> MotorStop::Repeat(const Answer& answer) {
  verifying_ = false;
  unanswered_ = 0;
  if (!IsOver(answer.end)) return std::nullopt;
  if (seen_off_) {
    return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                 Text("the stop coil reads 0 after %d stops: stop the motor by other means", writes_));
  }
  const bool bytes = !answer.ok() && answer.error != ErrorKind::kTimeout && !answer.refused();
  return GiveUp(ReasonOf(answer), CauseOf(answer) + (bytes ? " (bytes came that are no answer)" : ""));
}

Outcome MotorStop::GiveUp(std::int32_t reason, const std::string& cause) const {
  if (!sent_) return Final(CommandState::kFailed, reason, "the stop was not sent: " + cause);
  return Final(
      CommandState::kIndeterminate, reason,
      Text("the stop was sent %d times, but the stop coil could not be read: %s; stop the motor by other means",
           std::max(writes_, 1), cause.c_str()));
}

}  // namespace axlecast::tsubaki_sc
