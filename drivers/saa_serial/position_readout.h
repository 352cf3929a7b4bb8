#pragma once

#include "core/device/device.h"
#include "drivers/saa_serial/procedure.h"
#include "drivers/saa_serial/settings.h"

namespace axlecast::saa_serial {

// One reading, shown; with `look` also whether it looks like that of an encoder that was cleared to zero.
class PositionReadout final : public Procedure {
 public:
  PositionReadout(bool look, const SaaSettings& settings, const DeviceOutput& output, MonoNs patience, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs) const override { return Want::kReading; }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> OnReading(const Reading& reading, MonoNs now) override;
  std::optional<Outcome> OnTime(MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  [[nodiscard]] const char* Finding(std::uint32_t counts, MonoNs now) const;

  const bool look_;
  const SaaSettings& settings_;
  const DeviceOutput& output_;
  const MonoNs begun_;
  const MonoNs deadline_;
};

}  // namespace axlecast::saa_serial
