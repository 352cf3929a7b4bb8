#pragma once

#include <optional>
#include <string>

#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

// log_in: what the device does by itself when it must, on order, and again after a wrong password.
class LogIn final : public Procedure {
 public:
  explicit LogIn(const Requests& requests) : requests_(requests) {}

  [[nodiscard]] Exchange Next() const override { return requests_.Read(kLoginStatus); }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  std::optional<Outcome> OnLoggedIn() override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;
  [[nodiscard]] bool touched() const override { return true; }
  [[nodiscard]] bool begins_with_login() const override { return true; }

 private:
  const Requests& requests_;
};

}  // namespace axlecast::tsubaki_sc
