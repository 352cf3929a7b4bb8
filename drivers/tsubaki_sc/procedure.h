#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/device/operation.h"
#include "drivers/tsubaki_sc/answer.h"
#include "drivers/tsubaki_sc/requests.h"

namespace axlecast::tsubaki_sc {

// The login state that is wanted.
enum class LoginGoal : std::uint8_t { kIn, kOut };

// One order being carried out, request by request. After a final outcome it is not used any more.
//
// A request that the unit refuses because it is logged out (error 04) is not the procedure's business: the device
// logs in once and asks Next for the same again. After whatever leaves the line unclear the device asks something
// else first, see ScDevice.
class Procedure {
 public:
  virtual ~Procedure() = default;

  // What it wants to transmit now.
  [[nodiscard]] virtual Exchange Next() const = 0;
  // That is about to go on the wire.
  virtual void OnStarted() {}
  // The unit refused that because it is logged out, and did nothing: Next is asked again after a login.
  virtual void OnLoggedOut() {}
  // The exchange is over. An outcome: progress, or the final one.
  virtual std::optional<Outcome> OnAnswer(const Answer& answer) = 0;
  // The exchange that comes before its next request, to clear up the line, has failed. An outcome: the final one.
  virtual std::optional<Outcome> OnFenceFailed(const Answer&) { return std::nullopt; }
  // It cannot go on: the link is lost, the unit does not answer, or the login failed. The final outcome.
  [[nodiscard]] virtual Outcome GiveUp(std::int32_t reason, const std::string& cause) const = 0;
  // The login or logout that it begins with, or the login that a refusal led to, is done. An outcome when that was all.
  virtual std::optional<Outcome> OnLoginDone() { return std::nullopt; }

  // It may have changed something in the unit.
  [[nodiscard]] virtual bool touched() const { return false; }
  // The login state that it needs before its first request.
  [[nodiscard]] virtual std::optional<LoginGoal> begins_with() const { return std::nullopt; }
  [[nodiscard]] virtual bool may_log_in() const { return true; }
  // Its next request does not wait until an unclear line is cleared up: its reply cannot be mistaken.
  [[nodiscard]] virtual bool unfenced() const { return false; }
  // It goes on after failures for as long as it decides itself.
  [[nodiscard]] virtual bool repeats() const { return false; }
};

// Requests of a kind that may fail in a row.
inline constexpr int kTries = 3;

}  // namespace axlecast::tsubaki_sc
