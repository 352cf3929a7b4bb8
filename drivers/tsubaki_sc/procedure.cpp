#include "drivers/tsubaki_sc/procedure.h"

#include <utility>

#include "drivers/tsubaki_sc/operations.h"

namespace axlecast::tsubaki_sc {

CommandSlot::CommandSlot(const Runner::Policy& policy, DeviceOutput& output)
    : runner_(Operations(), policy, output) {}

bool CommandSlot::Begin(const DriverCommand& command, bool link_up, MonoNs now) {
  if (!runner_.Begin(command, link_up, now)) return false;
  login_goal_ = procedure().begins_with();
  login_taken_ = login_goal_.has_value();
  logs_out_after_ = false;
  fence_failures_ = 0;
  return true;
}

void CommandSlot::OnStarted() {
  runner_.OnStarted(true);
  if (login_goal_) {
    runner_.procedure().OnLoginStarted();
  } else {
    runner_.procedure().OnStarted();
  }
}

bool CommandSlot::TakeLogin(const Answer& answer) {
  if (!answer.refused_for_login() || login_taken_ || !procedure().may_log_in()) return false;
  login_taken_ = true;
  login_goal_ = LoginGoal::kIn;
  runner_.procedure().OnLoggedOut();
  return true;
}

bool CommandSlot::OnAnswer(const Answer& answer) {
  if (!runner_.TakeInFlight() || ended()) return false;
  if (TakeLogin(answer)) return true;
  Report(runner_.procedure().OnAnswer(answer));
  return false;
}

void CommandSlot::OnLoginDone(bool log_out_after) {
  if (ended()) return Release("; logged out again");
  login_goal_.reset();
  logs_out_after_ = log_out_after;
  Report(runner_.procedure().OnLoginDone());
}

void CommandSlot::OnLoginFailed(const std::string& cause) {
  if (ended()) return Release("; still logged in: " + cause);
  GiveUp({cause, command_status_t::REASON_DEVICE_REFUSED});
}

void CommandSlot::OnFenceFailed(const Answer& answer) {
  if (!busy()) return;
  ++fence_failures_;
  if (ended()) {
    if (fence_failures_ >= kTries) Release("; whether it is logged in is not known: " + CauseOf(answer));
    return;
  }
  if (const auto outcome = runner_.procedure().OnFenceFailed(answer)) return Report(outcome);
  if (!procedure().repeats() && fence_failures_ >= kTries) {
    GiveUp({CauseOf(answer), command_status_t::REASON_NO_REPLY});
  }
}

void CommandSlot::OnLinkLost() {
  if (ended()) return Release("; whether it is logged in is not known: the link was lost");
  runner_.OnLinkLost();
}

void CommandSlot::GiveUp(const Error& error) {
  logs_out_after_ = false;
  if (busy()) Report(procedure().GiveUp(error));
}

void CommandSlot::Report(const std::optional<Outcome>& outcome) {
  if (!outcome || !outcome->IsFinal() || !logs_out_after_) {
    runner_.Report(outcome);
    return;
  }
  held_outcome_ = outcome;
  login_goal_ = LoginGoal::kOut;
  fence_failures_ = 0;
}

void CommandSlot::Release(const std::string& note) {
  if (!ended()) return;
  Outcome outcome = *std::exchange(held_outcome_, std::nullopt);
  outcome.text += note;
  runner_.Report(outcome);
}

}  // namespace axlecast::tsubaki_sc
