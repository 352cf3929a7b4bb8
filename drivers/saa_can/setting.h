#pragma once

#include <string>

#include "drivers/saa_can/delivery.h"
#include "drivers/saa_can/operations.h"
#include "drivers/saa_can/period_meter.h"

namespace axlecast::saa_can {

// Sets the counting direction (22 NN, SAA manual 5.4.1 (3) ④⑤) with the byte that the configuration supplies. The
// reply says that it was accepted; only a motion shows it. It is refused where a position of the shaft at rest could
// pass for the reply.
class SetDirection final : public Procedure {
 public:
  SetDirection(std::uint8_t parameter, const OperationContext& around, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override;
  void OnStarted(const CanFrame& frame) override;
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return delivery_.state() != Delivery::State::kIdle; }

 private:
  std::optional<Outcome> OnBefore(const Interpreter::Heard& heard, MonoNs now);
  [[nodiscard]] Outcome WithCounts(Outcome outcome, const std::string& after) const;

  const std::uint8_t parameter_;
  const OperationContext around_;
  MonoNs deadline_;
  bool read_ = false;
  std::int64_t before_ = 0;
  Delivery delivery_;
};

// Why a direction cannot be set where the shaft stands.
[[nodiscard]] std::optional<Outcome> RefusalOfDirectionAt(std::int64_t counts, const SaaCanSettings& settings);

// Sets how often the encoder sends by itself (31 NN TT, ⑦), and measures it.
class SetPeriod final : public Procedure {
 public:
  SetPeriod(std::uint8_t per_second, const OperationContext& around);

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override;
  void OnStarted(const CanFrame& frame) override { delivery_.Start(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override { return LinkLostText(); }
  [[nodiscard]] bool touched() const override { return delivery_.state() != Delivery::State::kIdle; }

 private:
  [[nodiscard]] Outcome Judge() const;
  [[nodiscard]] Outcome LinkLostText() const;
  [[nodiscard]] MonoNs period() const { return kSecond / per_second_; }

  const std::uint8_t per_second_;
  const OperationContext around_;
  Delivery delivery_;
  bool acknowledged_ = false;
  MonoNs deadline_ = kNever;
  PeriodMeter meter_;
};

// Stops an encoder that sends by itself though it is to be asked (31 NN TT, ⑧) with the byte that the configuration
// supplies; then nothing is asked for a while, and nothing must come.
class StopCyclic final : public Procedure {
 public:
  StopCyclic(std::uint8_t parameter, const OperationContext& around) : parameter_(parameter), around_(around) {}

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override;
  void OnStarted(const CanFrame& frame) override { delivery_.Start(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return delivery_.state() != Delivery::State::kIdle; }
  [[nodiscard]] bool alone() const override { return touched(); }

  // Longer than the longest period, of one position a second.
  static constexpr MonoNs kQuiet = 1'500 * kMillisecond;
  // A position that was asked for, or was on its way, may still come so long.
  static constexpr MonoNs kSettle = 100 * kMillisecond;

 private:
  const std::uint8_t parameter_;
  const OperationContext around_;
  Delivery delivery_;
  bool acknowledged_ = false;
};

}  // namespace axlecast::saa_can
