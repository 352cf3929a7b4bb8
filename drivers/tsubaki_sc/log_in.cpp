#include "drivers/tsubaki_sc/log_in.h"

#include <axlecast/command_status_t.hpp>

#include "core/device/operation.h"

namespace axlecast::tsubaki_sc {

// The login itself is the device's; asked for a request of its own, it only looks.
std::optional<Outcome> LogIn::OnAnswer(const Answer& answer) {
  if (!answer.ok()) return GiveUp(command_status_t::REASON_DEVICE_REFUSED, CauseOf(answer));
  const bool logged_in = answer.reply.Register(0) == kSaysLoggedIn;
  if (logged_in == (goal_ == LoginGoal::kIn)) return OnLoginDone();
  return GiveUp(command_status_t::REASON_DEVICE_REFUSED, logged_in ? "it says logged in" : "it says logged out");
}

std::optional<Outcome> LogIn::OnLoginDone() {
  const bool in = goal_ == LoginGoal::kIn;
  Outcome outcome = Verified(in ? "the unit says logged in, until log_out or until its power goes off"
                                : "the unit says logged out");
  outcome.changes.push_back({"logged_in", "", in ? "1" : "0"});
  return outcome;
}

Outcome LogIn::GiveUp(std::int32_t reason, const std::string& cause) const {
  return Final(CommandState::kFailed, reason,
               (goal_ == LoginGoal::kIn ? "not logged in: " : "not logged out: ") + cause);
}

}  // namespace axlecast::tsubaki_sc
