#pragma once

#include <string>
#include <string_view>

#include "core/base/time.h"
#include "tools/monitor/monitor.h"

namespace axlecast {

// Returns all metrics of the machine for Prometheus: docs/metrics.md. `version`: of axlecast.
[[nodiscard]] std::string MetricsText(const Monitor& monitor, MonoNs now, std::string_view version);

}  // namespace axlecast
