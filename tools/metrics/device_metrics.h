#pragma once

#include "core/base/time.h"
#include "tools/metrics/exposition.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// Families axlecast_device_*: every device's state, counters and, while it answers, its position.
void AddDeviceMetrics(Exposition& out, const MachineView& machine, MonoNs now);

// Families axlecast_motor_*: what monitors read, while they answer.
void AddMotorMetrics(Exposition& out, const MachineView& machine, MonoNs now);

}  // namespace axlecast
