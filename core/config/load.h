#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// Reads and checks the machine's file, all errors in one go. No value when there is any.
// A driver knows its own family only: with `only_bus` the other buses' families, and what those say of their
// devices, are left to the processes that know them, and those buses are not in the result.
[[nodiscard]] std::optional<MachineConfig> LoadConfig(const std::string& file, ConfigErrors& errors,
                                                      std::string_view only_bus = {});
[[nodiscard]] std::optional<MachineConfig> ParseConfig(const std::string& text, ConfigErrors& errors,
                                                       std::string_view only_bus = {});

// The simulator of the bus's devices by the keys that stand under its `simulate`. Null after an error.
[[nodiscard]] std::unique_ptr<Simulator> MakeSimulator(const MachineConfig& machine, const BusConfig& bus,
                                                       ConfigErrors& errors);

// As LoadConfig, for a program that examines the machine's host instead of obeying the file: it may be one that others
// can write (OthersMayWriteConfig).
[[nodiscard]] std::optional<MachineConfig> LoadSharedConfig(const std::string& file, ConfigErrors& errors);

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
