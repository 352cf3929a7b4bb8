#pragma once

#include "core/config/machine_config.h"

namespace axlecast {

// The family of PolledDevice, without configuration keys and simulator: 65,536 counts a turn, single-turn only.
// "touch" is free, "write" needs a permit.
[[nodiscard]] const Family& PolledFamily();

// A bus of it, named rs485-0, with devices axis1, axis2 ... at the addresses 0, 1 ...
[[nodiscard]] BusConfig PolledBus(int devices);

}  // namespace axlecast
