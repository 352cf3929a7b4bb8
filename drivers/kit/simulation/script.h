#pragma once

#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/config/config_map.h"
#include "drivers/kit/simulation/simulated_device.h"

namespace axlecast {

// What happens to a simulated device when: quantities set at instants after the start, once or again and again.
class Script {
 public:
  using Assignments = std::vector<std::pair<std::string, std::string>>;  // name, value
  struct Step {
    MonoNs at = 0;  // after the start
    Assignments quantities;
  };

  Script() = default;
  // `initial` holds from the start on. `steps` are in the order of their instants; with a `period`, longer than the
  // last of these, they come again after it.
  Script(Assignments initial, std::vector<Step> steps, MonoNs period);

  void Start(SimulatedDevice& device, MonoNs now);
  [[nodiscard]] MonoNs NextDue() const;
  // Carries out every step that is due, each at its own instant.
  void Run(SimulatedDevice& device, MonoNs now);

 private:
  Assignments initial_;
  std::vector<Step> steps_;
  MonoNs period_ = kNever;
  MonoNs round_ = 0;  // when the steps began
  std::size_t next_ = 0;
};

// Reads a device's quantities (`names`, applied in that order) and its keys `script` and `script_period_s`
// (docs/simulation.md). Tries each on `trial`, a device to spare; errors go into the map's list.
[[nodiscard]] Script ReadScript(ConfigMap& map, std::span<const std::string_view> names, SimulatedDevice& trial);

}  // namespace axlecast
