#pragma once

#include <memory>
#include <optional>
#include <string>

#include "core/device/device.h"
#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

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
