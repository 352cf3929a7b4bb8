#pragma once

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

}  // namespace axlecast
