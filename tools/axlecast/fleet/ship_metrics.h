#pragma once

#include <string>

#include "tools/fleet/ship/ship_status.h"

namespace axlecast {

// Returns the metrics of a shipper for Prometheus: docs/fleet.md, Metrics.
[[nodiscard]] std::string ShipMetricsText(const ShipStatus& status);

}  // namespace axlecast
