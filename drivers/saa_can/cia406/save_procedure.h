#pragma once

#include "drivers/saa_can/cia406/procedure.h"
#include "drivers/saa_can/cia406/settings.h"

namespace axlecast::saa_can::cia406 {

// Has the encoder store its parameters (1010h sub 1, CiA 301 7.5.2.13): asked first whether it does so on command,
// then told once. It confirms when it is done.
class SaveProcedure final : public Procedure {
 public:
  SaveProcedure(const Cia406Settings& settings, MonoNs now);

  [[nodiscard]] std::optional<SdoRequest> Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  void OnStarted(const SdoRequest& request, MonoNs now) override;
  void OnNotSent() override;
  std::optional<Outcome> OnResult(const SdoResult& result) override;
  std::optional<Outcome> OnTime(MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;
  [[nodiscard]] bool touched() const override { return stage_ == Stage::kSent; }

 private:
  enum class Stage : std::uint8_t { kAsk, kSend, kSent };

  [[nodiscard]] std::optional<Outcome> OnAsked(const SdoResult& result);
  [[nodiscard]] static Outcome OnSaved(const SdoResult& result);

  Stage stage_ = Stage::kAsk;
  MonoNs deadline_;
};

}  // namespace axlecast::saa_can::cia406
