#pragma once

#include "core/base/time.h"
#include "tools/metrics/exposition.h"
#include "tools/monitor/machine_view.h"

namespace axlecast {

// Families axlecast_bus_*: every bus's state, counters, rates against theory and exchange times.
void AddBusMetrics(Exposition& out, const MachineView& machine, MonoNs now);

}  // namespace axlecast
