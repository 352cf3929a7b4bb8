#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// The load of a bus, calculated from its settings.
struct BusLoad {
  double round_us = 0;     // shortest time to read every device once; 0 unknown
  double max_hz = 0;       // maximum rate of the wire
  double poll_hz = 0;      // the actual rate: poll_hz, or max_hz if poll_hz is 0
  double utilisation = 0;  // share of the wire's time for readings, 0 to 1
};
[[nodiscard]] BusLoad LoadOf(const BusConfig& bus);

// Returns warnings about settings that are allowed, but probably wrong, each with a correction.
[[nodiscard]] std::vector<std::string> ConfigWarnings(const MachineConfig& machine);

// Formats the machine: a line for each bus and device, with refresh times and utilisation, and its keys.
[[nodiscard]] std::string ConfigText(const MachineConfig& machine);

// Returns one object: file, ok, errors, warnings, machine, buses, bridge. `machine` must be null if there are errors.
[[nodiscard]] nlohmann::ordered_json ConfigJson(const std::string& file, const MachineConfig* machine,
                                                const ConfigErrors& errors);

// Returns the warnings about who may command the machine, each with a correction.
[[nodiscard]] std::vector<std::string> KeyWarnings(const MachineConfig& machine);

// Formats a line for the journal, for each of the machine's own keys, and for each key that may command.
[[nodiscard]] std::string KeysText(const MachineConfig& machine);

// Returns an object: unsigned_commands, journal, key, drivers (public keys or null), keys.
[[nodiscard]] nlohmann::ordered_json KeysJson(const MachineConfig& machine);

}  // namespace axlecast
