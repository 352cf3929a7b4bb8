#pragma once

#include <string>

#include "core/device/device.h"
#include "drivers/saa_can/cia406/procedure.h"
#include "drivers/saa_can/cia406/settings.h"

namespace axlecast::saa_can::cia406 {

// Makes the present shaft angle read `target` (preset value 6003h): a reading that shows where the shaft was,
// standstill measured once more, one write, and readings that show its effect. The write goes out once and is never
// repeated.
class PresetProcedure final : public Procedure {
 public:
  PresetProcedure(std::uint32_t target, const Cia406Settings& settings, const DeviceOutput& output, MonoNs now);

  [[nodiscard]] std::optional<SdoRequest> Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs now) const override;
  void OnStarted(const SdoRequest& request, MonoNs now) override;
  void OnNotSent() override;
  std::optional<Outcome> OnResult(const SdoResult& result) override;
  std::optional<Outcome> OnTime(MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ >= Stage::kSent; }

 private:
  enum class Stage : std::uint8_t { kReadBefore, kWrite, kSent, kVerify };

  [[nodiscard]] std::optional<Outcome> OnRead(const SdoResult& result);
  [[nodiscard]] std::optional<Outcome> OnWritten(const SdoResult& result);
  [[nodiscard]] std::optional<Outcome> Verify(std::uint32_t position);
  [[nodiscard]] bool SameBefore() const;
  [[nodiscard]] Outcome WithBefore(Outcome outcome, const std::string& after) const;
  [[nodiscard]] bool AtRest(MonoNs now) const;
  [[nodiscard]] Outcome NotAtRest(MonoNs now) const;

  const std::uint32_t target_;
  const Cia406Settings& settings_;
  const DeviceOutput& output_;
  Stage stage_ = Stage::kReadBefore;
  MonoNs deadline_;
  MonoNs effect_from_ = 0;
  std::uint32_t before_ = 0;
  bool confirmed_ = false;  // the encoder answered that it took the write
  int readings_ = 0;        // after the write
};

}  // namespace axlecast::saa_can::cia406
