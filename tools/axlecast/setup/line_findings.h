#pragma once

#include "core/config/machine_config.h"
#include "tools/service/acceptance_result.h"

namespace axlecast {

// What carries a bus's bytes: adapter chip and its real rate, latency timer; of a simulated bus, that it is simulated.
[[nodiscard]] FindingGroup LineFindings(const BusConfig& bus);

}  // namespace axlecast
