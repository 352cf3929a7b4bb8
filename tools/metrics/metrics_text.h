#pragma once

#include <string>
#include <string_view>

#include "core/base/time.h"
#include "tools/monitor/monitor.h"

namespace axlecast {

// The machine as Prometheus reads it: docs/metrics.md. `version` of axlecast.
[[nodiscard]] std::string MetricsText(const Monitor& monitor, MonoNs now, std::string_view version);

}  // namespace axlecast
