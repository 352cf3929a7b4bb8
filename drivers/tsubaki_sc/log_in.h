#pragma once

#include <optional>
#include <string>

#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

// log_in and log_out: what the device does by itself when it must, on order. log_in tries again after a wrong password,
// and the unit stays logged in until log_out.
class LogIn final : public Procedure {
 public:
  LogIn(const Requests& requests, LoginGoal goal) : requests_(requests), goal_(goal) {}

  [[nodiscard]] Exchange Next() const override { return requests_.Read(kLoginStatus); }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  std::optional<Outcome> OnLoginDone() override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;
  [[nodiscard]] bool touched() const override { return true; }
  [[nodiscard]] std::optional<LoginGoal> begins_with() const override { return goal_; }

 private:
  const Requests& requests_;
  const LoginGoal goal_;
};

}  // namespace axlecast::tsubaki_sc
