#pragma once

#include <string>
#include <string_view>

#include "core/base/time.h"
#include "tools/metrics/exposition.h"
#include "tools/monitor/machine_view.h"
#include "tools/monitor/monitor.h"

namespace axlecast {

// The machine as Prometheus reads it: docs/metrics.md. `version` of axlecast.
[[nodiscard]] std::string MetricsText(const Monitor& monitor, MonoNs now, std::string_view version);

// Families axlecast_device_*: every device's state, counters and, while it answers, its position.
void AddDeviceMetrics(Exposition& out, const MachineView& machine, MonoNs now);

// Families axlecast_motor_*: what monitors read, while they answer.
void AddMotorMetrics(Exposition& out, const MachineView& machine, MonoNs now);

// Families axlecast_bus_*: every bus's state, counters, rates against theory and exchange times.
void AddBusMetrics(Exposition& out, const MachineView& machine, MonoNs now);

}  // namespace axlecast
