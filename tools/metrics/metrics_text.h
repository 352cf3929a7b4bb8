#pragma once

#include <string>
#include <string_view>

#include "core/base/time.h"
#include "tools/metrics/exposition.h"
#include "tools/monitor/machine_view.h"
#include "tools/monitor/monitor.h"

namespace axlecast {

// Returns all metrics of the machine for Prometheus: docs/metrics.md. `version`: of axlecast.
[[nodiscard]] std::string MetricsText(const Monitor& monitor, MonoNs now, std::string_view version);

// Adds the families axlecast_device_*: state and counters of every device, and its position while it answers.
void AddDeviceMetrics(Exposition& out, const MachineView& machine, MonoNs now);

// Adds the families axlecast_motor_*: readings of motor monitors, while they answer.
void AddMotorMetrics(Exposition& out, const MachineView& machine, MonoNs now);

// Adds the families axlecast_bus_*: state, counters, rates, their theoretical limits, and exchange times of every bus.
void AddBusMetrics(Exposition& out, const MachineView& machine, MonoNs now);

}  // namespace axlecast
