#pragma once

#include "core/config/machine_config.h"
#include "tools/service/acceptance_result.h"

namespace axlecast {

// Returns what is known of a bus's line: adapter chip, its actual rate and latency timer; or that the bus is simulated.
[[nodiscard]] FindingGroup LineFindings(const BusConfig& bus);

}  // namespace axlecast
