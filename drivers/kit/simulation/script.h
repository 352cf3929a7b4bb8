#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/base/time.h"
#include "core/config/config_map.h"

namespace axlecast {

// One device of a simulator, as the machine's file, a script or an operator sets it.
class SimulatedDevice {
 public:
  virtual ~SimulatedDevice() = default;

  // Moves the device's time to `now`. What is set afterwards happens at this time.
  virtual void Advance(MonoNs now) = 0;
  // Sets one quantity. The error states what would be right.
  [[nodiscard]] virtual Result<> Set(std::string_view name, std::string_view value) = 0;
};

// Quantities of a simulated device that are set at given times after the start, once or periodically.
class Script {
 public:
  using Assignments = std::vector<std::pair<std::string, std::string>>;  // name, value
  struct Step {
    MonoNs at = 0;  // after the start
    Assignments quantities;
  };

  Script() = default;
  // `initial` is set at the start. `steps` are in the order of their times. With a `period`, which must be longer than
  // the time of the last step, the steps are repeated after each period.
  Script(Assignments initial, std::vector<Step> steps, MonoNs period);

  void Start(SimulatedDevice& device, MonoNs now);
  [[nodiscard]] MonoNs NextDue() const;
  // Executes every step that is due. The device is advanced to the time of each step before the step.
  void Run(SimulatedDevice& device, MonoNs now);

 private:
  Assignments initial_;
  std::vector<Step> steps_;
  MonoNs period_ = kNever;
  MonoNs round_ = 0;  // start of the present period
  std::size_t next_ = 0;
};

// Reads a device's quantities (`names`, applied in that order) and its keys `script` and `script_period_s`
// (docs/simulation.md). Sets each value on `trial`, a copy of the device, to check it. Errors go into the map's list.
[[nodiscard]] Script ReadScript(ConfigMap& map, std::span<const std::string_view> names, SimulatedDevice& trial);

}  // namespace axlecast
