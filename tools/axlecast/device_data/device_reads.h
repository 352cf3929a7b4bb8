#pragma once

#include <string>
#include <vector>

#include "core/config/machine_config.h"
#include "tools/axlecast/command/operator_client.h"
#include "tools/service/acceptance_result.h"

namespace axlecast {

// Everything of a device that can be read without an argument and changes nothing: its memory, parameters, identity.

struct DeviceRead {
  std::string operation;
  CommandResult result;
};
[[nodiscard]] std::vector<DeviceRead> ReadEverything(OperatorClient& client, const BusConfig& bus,
                                                     const std::string& device);

// One line for each value that was read, and for each read that was not possible.
[[nodiscard]] FindingGroup ReadFindings(const BusConfig& bus, const std::vector<DeviceRead>& reads);

}  // namespace axlecast
