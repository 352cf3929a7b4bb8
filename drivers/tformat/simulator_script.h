#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/runtime/core/simulator.h"
#include "drivers/tformat/simulator_keys.h"

namespace axlecast {
struct BusConfig;
class ConfigMap;
}  // namespace axlecast

namespace axlecast::tformat {

// What happens to a simulated encoder when: quantities set at instants after the start, once or again and again.
class SimulatorScript {
 public:
  using Assignments = std::vector<std::pair<std::string_view, std::string>>;  // of QuantityNames()
  struct Step {
    MonoNs at = 0;  // after the start
    Assignments quantities;
  };

  // `initial` holds from the start on. `steps` are in the order of their instants; with a `period`, longer than the
  // last of these, they come again after it.
  SimulatorScript(Assignments initial, std::vector<Step> steps, MonoNs period);

  void Start(SimulatedAxis& axis, MonoNs now);
  [[nodiscard]] MonoNs NextDue() const;
  // Carries out every step that is due, each at its own instant.
  void Run(SimulatedAxis& axis, MonoNs now);

 private:
  Assignments initial_;
  std::vector<Step> steps_;
  MonoNs period_;
  MonoNs round_ = 0;  // when the steps began
  std::size_t next_ = 0;
};

// For Family::make_simulator: the simulator of the bus's one encoder from the bus's `simulate` mapping
// (docs/simulation.md). Null when a key is wrong: the errors are in the map's list.
[[nodiscard]] std::unique_ptr<Simulator> MakeTFormatSimulator(const BusConfig& bus, ConfigMap& simulate);

}  // namespace axlecast::tformat
