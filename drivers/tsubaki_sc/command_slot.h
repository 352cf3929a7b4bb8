#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/result.h"
#include "core/device/device.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tsubaki_sc/operations.h"
#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

// A CommandRunner with a login. If a command needs the login, the unit is logged in once, and the outcome is held until
// the unit is logged out again.
class CommandSlot {
 public:
  using Runner = CommandRunner<Procedure>;

  // Both arguments outlive the slot.
  CommandSlot(const Runner::Policy& policy, DeviceOutput& output) : runner_(Operations(), policy, output) {}

  [[nodiscard]] Result<> Validate(const DriverCommand& command, bool link_up, MonoNs now) const {
    return runner_.Validate(command, link_up, now);
  }
  // Returns whether the command has begun; otherwise its outcome was reported.
  bool Begin(const DriverCommand& command, bool link_up, MonoNs now) {
    if (!runner_.Begin(command, link_up, now)) return false;
    login_goal_ = procedure().begins_with();
    login_taken_ = login_goal_.has_value();
    logs_out_after_ = false;
    fence_failures_ = 0;
    return true;
  }
  [[nodiscard]] bool Cancel(const CommandId& id) { return !ended() && runner_.Cancel(id); }

  [[nodiscard]] bool busy() const { return runner_.busy(); }
  // Returns true if the command may transmit: it has not expired.
  [[nodiscard]] bool IsRunnable(MonoNs now) const { return runner_.Runnable(now) != nullptr; }
  // Precondition: busy().
  [[nodiscard]] const Procedure& procedure() const { return runner_.procedure(); }
  // Returns the login state for which the command waits.
  [[nodiscard]] std::optional<LoginGoal> login_goal() const { return busy() ? login_goal_ : std::nullopt; }
  // Returns true if the procedure has ended, and its outcome is held until the unit is logged out.
  [[nodiscard]] bool ended() const { return held_outcome_.has_value(); }

  // A request of the command, or of the login for it, is about to be transmitted.
  void OnStarted() {
    runner_.OnStarted(true);
    if (login_goal_) {
      runner_.procedure().OnLoginStarted();
    } else {
      runner_.procedure().OnStarted();
    }
  }
  // Passes the answer to the procedure. Returns true if the command waits for a login instead, because the unit refused
  // the request. This happens at most once for each command.
  [[nodiscard]] bool OnAnswer(const Answer& answer) {
    if (!runner_.TakeInFlight() || ended()) return false;
    if (TakeLogin(answer)) return true;
    Report(runner_.procedure().OnAnswer(answer));
    return false;
  }
  // The login goal is reached. `log_out_after`: hold the outcome until the unit is logged out.
  void OnLoginDone(bool log_out_after) {
    if (ended()) return Release("; logged out again");
    login_goal_.reset();
    logs_out_after_ = log_out_after;
    Report(runner_.procedure().OnLoginDone());
  }
  void OnLoginFailed(const std::string& cause) {
    if (ended()) return Release("; still logged in: " + cause);
    GiveUp({cause, command_status_t::REASON_DEVICE_REFUSED});
  }
  // Reports a held outcome, with `note` added, although the unit may still be logged in.
  void Release(const std::string& note) {
    if (!ended()) return;
    Outcome outcome = *std::exchange(held_outcome_, std::nullopt);
    outcome.text += note;
    runner_.Report(outcome);
  }
  void OnFenceFailed(const Answer& answer) {
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
  void OnFencePassed() { fence_failures_ = 0; }
  void OnLinkLost() {
    if (ended()) return Release("; whether it is logged in is not known: the link was lost");
    runner_.OnLinkLost();
  }
  void ExpireIfLate(MonoNs now) { runner_.ExpireIfLate(now); }

 private:
  [[nodiscard]] bool TakeLogin(const Answer& answer) {
    if (!answer.refused_for_login() || login_taken_ || !procedure().may_log_in()) return false;
    login_taken_ = true;
    login_goal_ = LoginGoal::kIn;
    runner_.procedure().OnLoggedOut();
    return true;
  }
  void GiveUp(const Error& error) {
    logs_out_after_ = false;
    if (busy()) Report(procedure().GiveUp(error));
  }
  void Report(const std::optional<Outcome>& outcome) {
    if (!outcome || !outcome->IsFinal() || !logs_out_after_) {
      runner_.Report(outcome);
      return;
    }
    held_outcome_ = outcome;
    login_goal_ = LoginGoal::kOut;
    fence_failures_ = 0;
  }

  Runner runner_;
  std::optional<LoginGoal> login_goal_;
  bool logs_out_after_ = false;
  std::optional<Outcome> held_outcome_;
  bool login_taken_ = false;
  int fence_failures_ = 0;
};

}  // namespace axlecast::tsubaki_sc
