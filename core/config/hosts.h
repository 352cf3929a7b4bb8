#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/config/machine_config.h"

namespace axlecast {

class ConfigMap;

// Reads `hosts` of the machine file's top level: what runs on which host. `buses`: the names of all buses.
[[nodiscard]] std::vector<HostConfig> LoadHosts(ConfigMap& root, const std::vector<std::string>& buses);

// Checks what depends on the other parts of the file: logs, broker, time base and URLs.
void CheckHosts(ConfigMap& root, const MachineConfig& machine);

// Returns the host of a bus; null if the file has no `hosts`.
[[nodiscard]] const HostConfig* HostOfBus(const std::vector<HostConfig>& hosts, std::string_view bus);

// Returns the part of the machine that runs on `host`: its buses; logs, broker, bridge and sets only if they run there. Without `hosts` in the
// file, this is the whole machine. Fails if the file has `hosts` and does not name this one.
[[nodiscard]] Result<MachineConfig> PartOn(const MachineConfig& machine, std::string_view host);

}  // namespace axlecast
