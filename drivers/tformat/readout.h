#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/device/device.h"
#include "drivers/tformat/procedure.h"
#include "drivers/tformat/settings.h"

namespace axlecast::tformat {

// One readout, shown: ID 1, 2 or 3.
class Readout final : public Procedure {
 public:
  // With `after`, the name of a reset, it looks whether that took effect: the change `finding` says (ID 3).
  Readout(DataId id, std::string after, const TFormatSettings& settings, const DeviceOutput& output);

  [[nodiscard]] Step Next(MonoNs now) const override;
  std::optional<Outcome> OnStarted(Bytes, MonoNs) override { return std::nullopt; }
  std::optional<Outcome> OnAnswer(const Answer& answer, MonoNs end) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 private:
  [[nodiscard]] Outcome Show(const Reply& reply) const;
  [[nodiscard]] Outcome ShowAll(const Reply& reply) const;
  [[nodiscard]] const char* Finding(const Reply& all, MonoNs now) const;

  DataId id_;
  std::string after_;
  const TFormatSettings& settings_;
  const DeviceOutput& output_;
  MonoNs end_ = 0;
  int failures_ = 0;
};

}  // namespace axlecast::tformat
