#pragma once

#include <axlecast/command_status_t.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/result.h"
#include "core/device/device.h"
#include "drivers/kit/command_runner.h"
#include "drivers/tsubaki_sc/requests.h"

namespace axlecast::tsubaki_sc {

enum class LoginGoal : std::uint8_t { kIn, kOut };

// One command, request by request. ScDevice sends the requests. It also sends what is common to all commands:
// - If the unit refuses a request because it is logged out (error 04), the device logs in once and calls Next again.
// - If a late reply is possible, the device first sends another request to clear the line.
class Procedure : public CommandProcedure {
 public:
  // Returns the next request.
  [[nodiscard]] virtual Exchange Next() const = 0;
  // Called before that request is transmitted.
  virtual void OnStarted() {}
  // Called before a request of the login is transmitted for this command.
  virtual void OnLoginStarted() {}
  // The unit refused that request because it is logged out, and did nothing. Next is called again after a login.
  virtual void OnLoggedOut() {}
  // Called with the answer. Returns progress, the final outcome, or nothing.
  virtual std::optional<Outcome> OnAnswer(const Answer& answer) = 0;
  // The request that clears the line has failed. Returns the final outcome, or nothing to continue.
  virtual std::optional<Outcome> OnFenceFailed(const Answer&) { return std::nullopt; }
  // Returns the final outcome if the command cannot continue: no link, no answer, or no login.
  [[nodiscard]] virtual Outcome GiveUp(const Error& error) const = 0;
  // The login or logout has succeeded. Returns the final outcome if the command has nothing else to do.
  virtual std::optional<Outcome> OnLoginDone() { return std::nullopt; }
  // Returns the login state that is required before the first request.
  [[nodiscard]] virtual std::optional<LoginGoal> begins_with() const { return std::nullopt; }
  [[nodiscard]] virtual bool may_log_in() const { return true; }
  // Returns true if no late reply can be mistaken for the reply to the next request, so that it does not wait until the
  // line is clear.
  [[nodiscard]] virtual bool unfenced() const { return false; }
  // Returns true if the procedure itself decides how many failures end it.
  [[nodiscard]] virtual bool repeats() const { return false; }

  [[nodiscard]] Outcome OnLinkLost() const final {
    return GiveUp({"the link was lost", command_status_t::REASON_NO_REPLY});
  }
};

// A CommandRunner with a login. If a command needs the login, the unit is logged in once, and the outcome is held until
// the unit is logged out again.
class CommandSlot {
 public:
  using Runner = CommandRunner<Procedure>;

  // Both arguments outlive the slot.
  CommandSlot(const Runner::Policy& policy, DeviceOutput& output);

  [[nodiscard]] Result<> Validate(const DriverCommand& command, bool link_up, MonoNs now) const {
    return runner_.Validate(command, link_up, now);
  }
  // Returns whether the command has begun; otherwise its outcome was reported.
  bool Begin(const DriverCommand& command, bool link_up, MonoNs now);
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
  void OnStarted();
  // Passes the answer to the procedure. Returns true if the command waits for a login instead, because the unit refused
  // the request. This happens at most once for each command.
  [[nodiscard]] bool OnAnswer(const Answer& answer);
  // The login goal is reached. `log_out_after`: hold the outcome until the unit is logged out.
  void OnLoginDone(bool log_out_after);
  void OnLoginFailed(const std::string& cause);
  // Reports a held outcome, with `note` added, although the unit may still be logged in.
  void Release(const std::string& note);
  void OnFenceFailed(const Answer& answer);
  void OnFencePassed() { fence_failures_ = 0; }
  void OnLinkLost();
  void ExpireIfLate(MonoNs now) { runner_.ExpireIfLate(now); }

 private:
  [[nodiscard]] bool TakeLogin(const Answer& answer);
  void GiveUp(const Error& error);
  void Report(const std::optional<Outcome>& outcome);

  Runner runner_;
  std::optional<LoginGoal> login_goal_;
  bool logs_out_after_ = false;
  std::optional<Outcome> held_outcome_;
  bool login_taken_ = false;
  int fence_failures_ = 0;
};

}  // namespace axlecast::tsubaki_sc
