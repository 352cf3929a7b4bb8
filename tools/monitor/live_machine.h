#pragma once

#include <functional>
#include <string>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "platform/net/lcm_port.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// Receives the messages of a running machine into a view.
class LiveMachine {
 public:
  LiveMachine(const MachineConfig& machine, const Clock& clock);

  // Fails if messages cannot be received. The error contains the lines that fix it.
  [[nodiscard]] const Result<>& state() const { return state_; }
  [[nodiscard]] const MachineView& view() const { return view_; }
  // Returns how to enlarge the kernel's buffer, or an empty text if it is large enough.
  [[nodiscard]] std::string buffer_advice() const { return port_.warning(); }

  // Receives until everything that a running machine reports once per second has arrived, at most for GatherTime. Fails if
  // the port failed.
  [[nodiscard]] Result<> GatherAll(const MachineConfig& machine);

  // Receives until `deadline` or until `enough` returns true. Fails if the port failed.
  [[nodiscard]] Result<> Gather(MonoNs deadline, const std::function<bool(const MachineView&)>& enough);

 private:
  const Clock& clock_;
  LcmPort port_;
  MachineView view_;
  Result<> state_;
};

// Returns the maximum time until everything that is reported once per second has been received. This includes a reading
// of each monitor that answers: on a full bus, a monitor is read every few seconds.
[[nodiscard]] MonoNs GatherTime(const MachineConfig& machine);

// Receives the messages of a machine until `enough` returns true, at most for `timeout`. Fails if they cannot be received.
[[nodiscard]] Result<MachineView> Observe(const MachineConfig& machine, const Clock& clock, MonoNs timeout,
                                          const std::function<bool(const MachineView&)>& enough);

}  // namespace axlecast
