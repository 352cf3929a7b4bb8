#pragma once

#include <functional>
#include <string>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "platform/net/lcm_port.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// A machine's messages as they come, gathered in a view.
class LiveMachine {
 public:
  LiveMachine(const MachineConfig& machine, const Clock& clock);

  // Empty when messages can come, else the cause and the lines that mend it.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] const MachineView& view() const { return view_; }
  // Empty, or why the kernel's buffer is smaller than it should be, and what mends that.
  [[nodiscard]] std::string warning() const { return port_.warning(); }

  // Receives until everything that a running machine reports once a second has come, at most for GatherTime. False when the
  // port failed.
  [[nodiscard]] bool GatherAll(const MachineConfig& machine);

  // Takes in what comes until `deadline` or until `enough` says so. False when the port failed.
  [[nodiscard]] bool Gather(MonoNs deadline, const std::function<bool(const MachineView&)>& enough);

 private:
  const Clock& clock_;
  LcmPort port_;
  MachineView view_;
  std::string problem_;
};

// Returns how long it takes at most until everything that reports once a second has been received. A reading of each
// monitor that answers is part of it: on a full bus each is read every few seconds.
[[nodiscard]] MonoNs GatherTime(const MachineConfig& machine);

// Receives the messages of a machine until `enough` returns true, at most for `timeout`. Fails if they cannot be received.
[[nodiscard]] Result<MachineView> Observe(const MachineConfig& machine, const Clock& clock, MonoNs timeout,
                                          const std::function<bool(const MachineView&)>& enough);

}  // namespace axlecast
