#pragma once

#include <string>
#include <vector>

#include "tools/monitor/machine_view.h"

namespace axlecast {

// Why the machine is not good at `now`, one sentence each; empty when it is. The one definition of "good", for people
// and exit codes (docs/cli.md, "Good"): every device is ONLINE, every bus UP, and neither a bridge that serves nor the
// bridge to a broker reports an alarm of severity ERROR or worse, or that its broker is away.
[[nodiscard]] std::vector<std::string> MachineFaults(const MachineView& machine, MonoNs now);

}  // namespace axlecast
