#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/device/can.h"
#include "drivers/kit/simulation/script.h"
#include "drivers/kit/simulation/simulated_fault.h"

namespace axlecast {

// One encoder on a simulated CAN bus, of whatever model. The family's simulator holds them and is the bus between
// them and the host. A node runs its own script. Instants given to it must not run backwards.
class SimulatedCanNode : public SimulatedDevice {
 public:
  using Send = std::function<void(const CanFrame& frame)>;  // onto the bus, now

  // It is powered, and takes part in the bus: it acknowledges what others send.
  [[nodiscard]] virtual bool present() const = 0;
  // The rate at which it takes part, bit/s; 0: that of the bus as configured.
  [[nodiscard]] virtual std::int64_t bitrate() const { return 0; }
  // A frame of the host's or of another node's was on the bus. What it answers is sent by OnDue.
  virtual void OnFrame(const CanFrame& frame, MonoNs now) = 0;
  // What is wrong with it or with its way to the host.
  [[nodiscard]] virtual const SimulatedFault& fault() const = 0;
  // Something (an answer, a cyclic frame, a script step) is due; kNever when nothing is.
  [[nodiscard]] virtual MonoNs NextDue() const = 0;
  virtual void OnDue(MonoNs now, const Send& send) = 0;
  // Quantities with their values at `now`, then what was done to it.
  [[nodiscard]] virtual std::vector<std::pair<std::string, std::string>> State(MonoNs now) const = 0;
};

}  // namespace axlecast
