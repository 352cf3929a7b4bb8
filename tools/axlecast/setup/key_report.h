#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/config/machine_config.h"

namespace axlecast {

// Who may command a machine, for `axlecast check-config`.

// What is allowed but probably not meant, each with its remedy.
[[nodiscard]] std::vector<std::string> KeyWarnings(const MachineConfig& machine);

// A line for the journal, for each of the machine's own keys and for each key that may command.
[[nodiscard]] std::string KeysText(const MachineConfig& machine);

// The same: unsigned_commands, journal, key, drivers (public keys or null), keys.
[[nodiscard]] nlohmann::ordered_json KeysJson(const MachineConfig& machine);

}  // namespace axlecast
