#pragma once

#include <optional>
#include <string>

#include "drivers/runtime/config/config_map.h"
#include "drivers/runtime/config/machine_config.h"

namespace axlecast {

// Reads and checks the machine's file, all errors in one go. No value when there is any.
[[nodiscard]] std::optional<MachineConfig> LoadConfig(const std::string& file, ConfigErrors& errors);
[[nodiscard]] std::optional<MachineConfig> ParseConfig(const std::string& text, ConfigErrors& errors);

// The bus's simulate mapping, for Family::make_simulator.
[[nodiscard]] std::unique_ptr<Simulator> MakeSimulator(const MachineConfig& machine, const BusConfig& bus,
                                                       ConfigErrors& errors);

}  // namespace axlecast
