#include "drivers/tsubaki_sc/order_slot.h"

#include <axlecast/command_status_t.hpp>
#include <utility>

#include "drivers/runtime/device/outcome_text.h"

namespace axlecast::tsubaki_sc {

void OrderSlot::Take(const Order& order, std::unique_ptr<Procedure> procedure) {
  procedure_ = std::move(procedure);
  id_ = order.id;
  begin_by_ = order.begin_by;
  begun_ = false;
  waits_for_login_ = procedure_->begins_with_login();
  login_taken_ = waits_for_login_;
  fence_failures_ = 0;
}

void OrderSlot::OnStarted() {
  begun_ = true;
  if (!waits_for_login_) procedure_->OnStarted();
}

bool OrderSlot::TakeLogin(const Answer& answer) {
  if (!answer.refused_for_login() || login_taken_ || !procedure_->may_log_in()) return false;
  login_taken_ = true;
  waits_for_login_ = true;
  procedure_->OnLoggedOut();
  return true;
}

void OrderSlot::OnAnswer(const Answer& answer) {
  if (!held()) return;  // cancelled meanwhile
  if (const auto outcome = procedure_->OnAnswer(answer)) Report(*outcome);
}

void OrderSlot::OnLoggedIn() {
  waits_for_login_ = false;
  if (const auto outcome = procedure_->OnLoggedIn()) Report(*outcome);
}

void OrderSlot::OnFenceFailed(const std::string& cause) {
  if (held() && ++fence_failures_ >= kTries) GiveUp(command_status_t::REASON_NO_REPLY, cause);
}

void OrderSlot::GiveUp(std::int32_t reason, const std::string& cause) {
  if (held()) Report(procedure_->GiveUp(reason, cause));
}

void OrderSlot::ExpireIfLate(MonoNs now) {
  if (!held() || begun_ || now <= begin_by_) return;
  Report(Final(OrderState::kExpired, command_status_t::REASON_DEADLINE,
               "nothing was done: the unit could not be asked before its time to begin was over"));
}

bool OrderSlot::Cancel(const CommandId& id) {
  if (!held() || id != id_ || procedure_->touched()) return false;
  procedure_.reset();
  return true;
}

void OrderSlot::Report(const Outcome& outcome) {
  if (outcome.IsFinal()) procedure_.reset();
  output_.OnOutcome(id_, outcome);
}

}  // namespace axlecast::tsubaki_sc
