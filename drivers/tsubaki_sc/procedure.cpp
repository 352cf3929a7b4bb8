#include "drivers/tsubaki_sc/procedure.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"

namespace axlecast::tsubaki_sc {

void CommandSlot::Take(const DriverCommand& order, std::unique_ptr<Procedure> procedure) {
  procedure_ = std::move(procedure);
  id_ = order.id;
  begin_by_ = order.begin_by;
  begun_ = false;
  login_goal_ = procedure_->begins_with();
  login_taken_ = login_goal_.has_value();
  logs_out_after_ = false;
  fence_failures_ = 0;
}

void CommandSlot::OnStarted() {
  begun_ = true;
  if (!login_goal_) procedure_->OnStarted();
}

bool CommandSlot::TakeLogin(const Answer& answer) {
  if (!answer.refused_for_login() || login_taken_ || !procedure_->may_log_in()) return false;
  login_taken_ = true;
  login_goal_ = LoginGoal::kIn;
  procedure_->OnLoggedOut();
  return true;
}

void CommandSlot::OnAnswer(const Answer& answer) {
  if (!held() || ended()) return;  // cancelled meanwhile
  if (const auto outcome = procedure_->OnAnswer(answer)) Report(*outcome);
}

void CommandSlot::OnLoginDone(bool log_out_after) {
  if (ended()) return Release("; logged out again");
  login_goal_.reset();
  logs_out_after_ = log_out_after;
  if (const auto outcome = procedure_->OnLoginDone()) Report(*outcome);
}

void CommandSlot::OnLoginFailed(const std::string& problem) {
  if (ended()) return Release("; still logged in: " + problem);
  GiveUp(command_status_t::REASON_DEVICE_REFUSED, problem);
}

void CommandSlot::OnFenceFailed(const Answer& answer) {
  if (!held()) return;
  ++fence_failures_;
  if (ended()) {
    if (fence_failures_ >= kTries) Release("; whether it is logged in is not known: " + CauseOf(answer));
    return;
  }
  if (const auto outcome = procedure_->OnFenceFailed(answer)) return Report(*outcome);
  if (!procedure_->repeats() && fence_failures_ >= kTries) {
    GiveUp(command_status_t::REASON_NO_REPLY, CauseOf(answer));
  }
}

void CommandSlot::GiveUp(std::int32_t reason, const std::string& cause) {
  if (ended()) return Release("; whether it is logged in is not known: " + cause);
  logs_out_after_ = false;
  if (held()) Report(procedure_->GiveUp(reason, cause));
}

void CommandSlot::ExpireIfLate(MonoNs now) {
  if (!held() || begun_ || now <= begin_by_) return;
  Report(Final(CommandState::kExpired, command_status_t::REASON_DEADLINE,
               "nothing was done: the unit could not be asked before its time to begin was over"));
}

bool CommandSlot::Cancel(const CommandId& id) {
  if (!held() || ended() || id != id_ || procedure_->touched()) return false;
  procedure_.reset();
  login_goal_.reset();
  return true;
}

void CommandSlot::Report(const Outcome& outcome) {
  if (!outcome.IsFinal() || !logs_out_after_) return Emit(outcome);
  held_outcome_ = outcome;
  login_goal_ = LoginGoal::kOut;
  fence_failures_ = 0;
}

void CommandSlot::Release(const std::string& note) {
  if (!ended()) return;
  Outcome outcome = *std::exchange(held_outcome_, std::nullopt);
  outcome.text += note;
  Emit(outcome);
}

void CommandSlot::Emit(const Outcome& outcome) {
  if (outcome.IsFinal()) {
    procedure_.reset();
    login_goal_.reset();
  }
  output_.OnOutcome(id_, outcome);
}

}  // namespace axlecast::tsubaki_sc
