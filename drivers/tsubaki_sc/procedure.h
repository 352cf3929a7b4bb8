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

}  // namespace axlecast::tsubaki_sc
