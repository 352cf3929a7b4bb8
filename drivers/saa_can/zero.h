#pragma once

#include "drivers/saa_can/delivery.h"
#include "drivers/saa_can/operations.h"

namespace axlecast::saa_can {

// Clears the encoder to zero (20 NN, SAA manual 5.4.1 (3) ⑥): a position that shows where the shaft was, standstill
// measured once more, the frame once, and positions that show the effect. The reply alone proves nothing: it looks
// like a position.
class Zero final : public Procedure {
 public:
  Zero(const OperationContext& around, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs now) const override;
  void OnStarted(const CanFrame& frame) override;
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ >= Stage::kDeliver; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kSend, kDeliver, kVerify };

  std::optional<Outcome> OnBefore(const Interpreter::Heard& heard, MonoNs now);
  std::optional<Outcome> OnDelivery(const Event& event, MonoNs now);
  std::optional<Outcome> OnVerify(const Interpreter::Heard& heard, MonoNs now);
  [[nodiscard]] bool SameBefore() const;
  [[nodiscard]] Outcome Judge(std::int64_t counts) const;
  [[nodiscard]] Outcome WithCounts(Outcome outcome, const std::string& after) const;

  const OperationContext around_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs deadline_;
  Delivery delivery_;
  std::int64_t before_ = 0;
  bool acknowledged_ = false;
  int looks_ = 0;
};

}  // namespace axlecast::saa_can
