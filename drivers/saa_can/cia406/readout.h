#pragma once

#include <optional>
#include <span>
#include <vector>

#include "drivers/saa_can/cia406/procedure.h"

namespace axlecast::saa_can::cia406 {

// Objects read one after the other, and shown. One that the encoder does not offer is left out.
class Readout : public Procedure {
 public:
  using Values = std::vector<std::optional<std::uint32_t>>;  // as `objects`

  Readout(std::span<const ObjectId> objects, MonoNs deadline)
      : objects_(objects.begin(), objects.end()), deadline_(deadline) {}

  [[nodiscard]] std::optional<SdoRequest> Wants(MonoNs now) const override;
  [[nodiscard]] MonoNs Due(MonoNs) const override { return deadline_; }
  std::optional<Outcome> OnResult(const SdoResult& result) override;
  std::optional<Outcome> OnTime(MonoNs now) override;
  [[nodiscard]] Outcome OnLinkLost() const override;

 protected:
  // All have been read.
  [[nodiscard]] virtual Outcome Show(const Values& values, MonoNs now) const = 0;

 private:
  const std::vector<ObjectId> objects_;
  const MonoNs deadline_;
  Values values_;
};

}  // namespace axlecast::saa_can::cia406
