#include "drivers/tsubaki_sc/log_in.h"

#include <axlecast/command_status_t.hpp>

#include "drivers/runtime/device/outcome_text.h"

namespace axlecast::tsubaki_sc {

// The login itself is the device's; asked for a request of its own, it only looks.
std::optional<Outcome> LogIn::OnAnswer(const Answer& answer) {
  if (answer.ok() && answer.reply.Register(0) == kSaysLoggedIn) return OnLoggedIn();
  return GiveUp(command_status_t::REASON_DEVICE_REFUSED, answer.ok() ? "it says logged out" : CauseOf(answer));
}

std::optional<Outcome> LogIn::OnLoggedIn() {
  Outcome outcome = Verified("the unit says logged in, until its power goes off");
  outcome.changes.push_back({"logged_in", "", "1"});
  return outcome;
}

Outcome LogIn::GiveUp(std::int32_t reason, const std::string& cause) const {
  return Final(OrderState::kFailed, reason, "not logged in: " + cause);
}

}  // namespace axlecast::tsubaki_sc
