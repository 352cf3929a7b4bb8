#pragma once

#include <optional>

#include "core/device/operation.h"
#include "drivers/saa_can/cia406/sdo_client.h"

namespace axlecast::saa_can::cia406 {

// One order being carried out, by SDO transfers one after the other. After a final outcome it is not used any more.
class Procedure {
 public:
  virtual ~Procedure() = default;

  // The transfer that it wants as soon as the bus allows.
  [[nodiscard]] virtual std::optional<SdoRequest> Wants(MonoNs now) const = 0;
  // It wants to be asked again by then.
  [[nodiscard]] virtual MonoNs Due(MonoNs now) const = 0;

  // The transfer is about to go out; it did not, the controller's queue is full.
  virtual void OnStarted([[maybe_unused]] const SdoRequest& request, [[maybe_unused]] MonoNs now) {}
  virtual void OnNotSent() {}
  // Any transfer of the node has ended, also one that others wanted.
  virtual std::optional<Outcome> OnResult(const SdoResult& result) = 0;
  // Time has gone on.
  virtual std::optional<Outcome> OnTime(MonoNs now) = 0;
  // The link is gone.
  [[nodiscard]] virtual Outcome OnLinkLost() const = 0;

  // It may have changed something in the encoder.
  [[nodiscard]] virtual bool touched() const { return false; }
};

}  // namespace axlecast::saa_can::cia406
