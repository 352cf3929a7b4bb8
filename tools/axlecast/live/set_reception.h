#pragma once

#include <axlecast/position_set_t.hpp>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "client/axlecast/position_sets.h"
#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "platform/net/lcm_port.h"

namespace axlecast {

// Returns what a builder needs to know of a set of the machine. `time` outlives the builder; it is used if the machine has a time base.
[[nodiscard]] PositionSetBuilder::Options SetOptionsOf(const MachineConfig& machine, const SetConfig& set,
                                                       const TimeBase& time);

// Receives the positions of the axes of some sets, and joins them. Used by one thread.
class SetReception {
 public:
  using Take = std::function<void(const SetConfig& set, const position_set_t& message)>;

  SetReception(const MachineConfig& machine, std::vector<SetConfig> sets, const Clock& clock);

  // `take` receives every set that is closed, without utime, mono_ns, boot_id, seq, machine_id and clock_id.
  [[nodiscard]] Result<> Open(Take take);
  // Handles what arrives until `until`, which the caller keeps so near that it notices signals. Returns false if the port failed.
  [[nodiscard]] bool Gather(MonoNs until);
  // Sum of all sets.
  [[nodiscard]] PositionSetBuilder::Totals totals() const;
  [[nodiscard]] LcmPort& port() { return port_; }

 private:
  void OnPosition(std::size_t set, std::size_t axis, Bytes message);
  // Passes on the closed sets. Returns the instant at which the next one waits for no longer.
  MonoNs PassClosed();

  std::vector<SetConfig> sets_;
  const Clock& clock_;
  LcmPort port_;
  TimeBase time_;
  std::vector<PositionSetBuilder> builders_;  // in the order of sets_
  Take take_;
};

}  // namespace axlecast
