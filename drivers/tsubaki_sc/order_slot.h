#pragma once

#include <memory>
#include <optional>
#include <string>

#include "drivers/runtime/core/device.h"
#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

// Room for one order and its procedure: its deadline, its one login, its outcome.
class OrderSlot {
 public:
  explicit OrderSlot(DeviceOutput& output) : output_(output) {}

  [[nodiscard]] bool held() const { return procedure_ != nullptr; }
  // It may transmit now; false when its time to begin is over.
  [[nodiscard]] bool Wants(MonoNs now) const { return held() && (begun_ || now <= begin_by_); }
  [[nodiscard]] const Procedure& procedure() const { return *procedure_; }
  // It goes on when the unit is logged in.
  [[nodiscard]] bool waits_for_login() const { return waits_for_login_; }

  void Take(const Order& order, std::unique_ptr<Procedure> procedure);
  void OnStarted();
  // True when the answer is a refusal that a login may mend: once for each order.
  [[nodiscard]] bool TakeLogin(const Answer& answer);
  void OnAnswer(const Answer& answer);
  void OnLoggedIn();
  // The request that comes before its own, to clear up the line, has failed.
  void OnFenceFailed(const std::string& cause);
  void OnFencePassed() { fence_failures_ = 0; }
  void GiveUp(std::int32_t reason, const std::string& cause);
  void ExpireIfLate(MonoNs now);
  [[nodiscard]] bool Cancel(const CommandId& id);

 private:
  void Report(const Outcome& outcome);

  DeviceOutput& output_;
  std::unique_ptr<Procedure> procedure_;
  CommandId id_{};
  MonoNs begin_by_ = kNever;
  bool begun_ = false;  // a request of it was sent
  bool waits_for_login_ = false;
  bool login_taken_ = false;
  int fence_failures_ = 0;
};

}  // namespace axlecast::tsubaki_sc
