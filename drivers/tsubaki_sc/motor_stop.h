#pragma once

#include <optional>
#include <string>

#include "drivers/tsubaki_sc/procedure.h"

namespace axlecast::tsubaki_sc {

// stop_motor: sets coil 100 at once, then reads it. A stop whose reply is lost, or that reads 0 afterwards, is sent
// again: stopping twice does no harm. The first ones do not wait until an unclear line is cleared up.
// Not an emergency stop: it takes a bus, a program and a unit that work.
class MotorStop final : public Procedure {
 public:
  explicit MotorStop(const Requests& requests) : requests_(requests) {}

  [[nodiscard]] Exchange Next() const override;
  void OnStarted() override { sent_ = sent_ || !verifying_; }
  void OnLoggedOut() override { sent_ = writes_ > 0; }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;
  [[nodiscard]] bool touched() const override { return sent_; }
  [[nodiscard]] bool unfenced() const override { return !verifying_; }

 private:
  std::optional<Outcome> OnWritten(const Answer& answer);
  std::optional<Outcome> OnCoil(const Answer& answer);

  const Requests& requests_;
  bool verifying_ = false;
  bool sent_ = false;
  int writes_ = 0;
  int failures_ = 0;
};

}  // namespace axlecast::tsubaki_sc
