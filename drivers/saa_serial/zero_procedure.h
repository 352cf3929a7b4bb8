#pragma once

#include <string>

#include "core/device/device.h"
#include "drivers/saa_serial/procedure.h"
#include "drivers/saa_serial/settings.h"

namespace axlecast::saa_serial {

// Clears the encoder to zero (SAA manual 5.1.2 (5), 5.1.6 (1)): a reading that shows where the shaft was, standstill
// measured once more, one pulse on CLR or one BC AA CX, and, because nothing answers these, readings that show the
// effect. The request goes out once and is never repeated.
class ZeroProcedure final : public Procedure {
 public:
  // `patience`: how long it waits for a reading, before and after.
  ZeroProcedure(const SaaSettings& settings, const DeviceOutput& output, MonoNs patience, MonoNs now);

  [[nodiscard]] Want Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs now) const override {
    return stage_ == Stage::kSettle && now < effect_from_ ? effect_from_ : deadline_;
  }
  std::optional<Outcome> OnReading(const Reading& reading, MonoNs now) override;
  std::optional<Outcome> OnTime(MonoNs now) override;
  void OnZeroStarted() override { stage_ = Stage::kSent; }
  std::optional<Outcome> OnZeroed(MonoNs effect_from) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ >= Stage::kSent; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kSend, kSent, kSettle };

  [[nodiscard]] bool AtRest(MonoNs now) const;
  [[nodiscard]] bool SameBefore() const;
  [[nodiscard]] std::optional<Outcome> Verify(const Reading& reading);
  [[nodiscard]] Outcome Judge(std::uint32_t counts) const;
  [[nodiscard]] Outcome WithBefore(Outcome outcome, const std::string& after) const;

  const SaaSettings& settings_;
  const DeviceOutput& output_;
  const MonoNs patience_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs deadline_;
  MonoNs effect_from_ = kNever;
  std::uint32_t before_ = 0;
  int readings_ = 0;       // that may show the effect
  int near_in_a_row_ = 0;  // of these
};

// Whether a position is what an encoder that was just cleared to zero may read.
[[nodiscard]] bool IsNearZero(std::uint32_t counts, const SaaSettings& settings);

}  // namespace axlecast::saa_serial
