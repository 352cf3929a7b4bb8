#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// Makes the simulators of a machine's buses by the keys that stand under their `simulate`. Reads the file's text once,
// however many buses there are; MakeSimulator reads it for one.
class SimulatorMaker {
 public:
  // Both must outlive the maker.
  SimulatorMaker(const MachineConfig& machine, ConfigErrors& errors);
  // Returns null after an error.
  [[nodiscard]] std::unique_ptr<Simulator> Make(const BusConfig& bus);

 private:
  ConfigErrors* errors_;
  std::map<std::string, ConfigMap, std::less<>> buses_;
};

}  // namespace axlecast
