#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "core/device/device.h"
#include "core/device/operation.h"
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

// Room for one order and its procedure: its deadline, its one login, its outcome. The outcome of an order that logged
// the unit in is held until the unit is logged out again.
class CommandSlot {
 public:
  explicit CommandSlot(DeviceOutput& output) : output_(output) {}

  [[nodiscard]] bool held() const { return procedure_ != nullptr; }
  // It may transmit now; false when its time to begin is over.
  [[nodiscard]] bool Wants(MonoNs now) const { return held() && (begun_ || now <= begin_by_); }
  [[nodiscard]] const Procedure& procedure() const { return *procedure_; }
  // The login state that it waits for; nothing when it waits for none.
  [[nodiscard]] std::optional<LoginGoal> login_goal() const { return login_goal_; }
  // Its procedure has ended, and its outcome waits until the unit is logged out.
  [[nodiscard]] bool ended() const { return held_outcome_.has_value(); }

  void Take(const DriverCommand& order, std::unique_ptr<Procedure> procedure);
  void OnStarted();
  // True when the answer is a refusal that a login may mend: once for each order.
  [[nodiscard]] bool TakeLogin(const Answer& answer);
  void OnAnswer(const Answer& answer);
  // The login state that it waits for is reached. With `log_out_after` the order's outcome waits for a logout.
  void OnLoginDone(bool log_out_after);
  void OnLoginFailed(const std::string& problem);
  // The unit stays logged in: an outcome that waits is reported.
  void Release(const std::string& note);
  // The request that comes before its own, to clear up the line, has failed.
  void OnFenceFailed(const Answer& answer);
  void OnFencePassed() { fence_failures_ = 0; }
  void GiveUp(std::int32_t reason, const std::string& cause);
  void ExpireIfLate(MonoNs now);
  [[nodiscard]] bool Cancel(const CommandId& id);

 private:
  void Report(const Outcome& outcome);
  void Emit(const Outcome& outcome);

  DeviceOutput& output_;
  std::unique_ptr<Procedure> procedure_;
  CommandId id_{};
  MonoNs begin_by_ = kNever;
  bool begun_ = false;  // a request of it was sent
  std::optional<LoginGoal> login_goal_;
  bool logs_out_after_ = false;
  std::optional<Outcome> held_outcome_;
  bool login_taken_ = false;
  int fence_failures_ = 0;
};

}  // namespace axlecast::tsubaki_sc
