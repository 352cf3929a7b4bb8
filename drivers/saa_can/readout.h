#pragma once

#include <string>

#include "drivers/saa_can/node_search.h"
#include "drivers/saa_can/operations.h"
#include "drivers/saa_can/period_meter.h"

namespace axlecast::saa_can {

// One position, shown; also whether it looks as after the operation that was ordered before.
class ReadPosition final : public Procedure {
 public:
  enum class After : std::uint8_t { kNothing, kZero, kDirection, kBitrate };
  ReadPosition(After after, const OperationContext& around, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs) const override { return Position{}; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  [[nodiscard]] const char* Finding(std::int64_t counts, MonoNs now) const;

  const After after_;
  const OperationContext around_;
  const MonoNs deadline_;
};

// Measures how often the encoder sends by itself, to see whether set_period took effect.
class LookForPeriod final : public Procedure {
 public:
  LookForPeriod(MonoNs period, const OperationContext& around, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs) const override { return Nothing{}; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  const MonoNs period_;
  const MonoNs deadline_;
  PeriodMeter meter_;
};

// Looks at which node id the encoder answers, to see whether set_node_id took effect.
class LookForNode final : public Procedure {
 public:
  LookForNode(std::uint8_t node, const OperationContext& around);

  [[nodiscard]] Want Wants(MonoNs) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override { return search_.due(); }
  void OnStarted(const CanFrame& frame) override { search_.OnStarted(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Heard& heard, MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool alone() const override { return true; }

 private:
  const std::uint8_t node_;
  const OperationContext around_;
  NodeSearch search_;
};

}  // namespace axlecast::saa_can
