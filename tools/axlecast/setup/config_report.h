#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/config/config_map.h"
#include "core/config/machine_config.h"

namespace axlecast {

// What a bus's settings come to.
struct BusLoad {
  double round_us = 0;     // shortest time to read every device once; 0 unknown
  double most_hz = 0;      // rate at which the wire is full
  double poll_hz = 0;      // as it will run: poll_hz, or most_hz where that is 0
  double utilisation = 0;  // part of the wire's time that readings take, 0..1
};
[[nodiscard]] BusLoad LoadOf(const BusConfig& bus);

// What is allowed but probably not meant, each with its remedy.
[[nodiscard]] std::vector<std::string> ConfigWarnings(const MachineConfig& machine);

// The machine for people: a line for each bus and device, with refresh times and utilisation, and its keys.
[[nodiscard]] std::string ConfigText(const MachineConfig& machine);

// The same as one object: file, ok, errors, warnings, machine, buses, bridge. `machine` is null when there are errors.
[[nodiscard]] nlohmann::ordered_json ConfigJson(const std::string& file, const MachineConfig* machine,
                                                const ConfigErrors& errors);

// Who may command a machine, for `axlecast check-config`.

// What is allowed but probably not meant, each with its remedy.
[[nodiscard]] std::vector<std::string> KeyWarnings(const MachineConfig& machine);

// A line for the journal, for each of the machine's own keys and for each key that may command.
[[nodiscard]] std::string KeysText(const MachineConfig& machine);

// The same: unsigned_commands, journal, key, drivers (public keys or null), keys.
[[nodiscard]] nlohmann::ordered_json KeysJson(const MachineConfig& machine);

}  // namespace axlecast
