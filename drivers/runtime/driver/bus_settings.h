#pragma once

#include "drivers/runtime/bus/bus.h"
#include "drivers/runtime/config/machine_config.h"

namespace axlecast {

// How a configured bus is run. On a bus with several devices a silent one pauses for longer, because its timeouts
// cost the others their turns; a device alone on its bus costs nobody, and is back within 100 ms.
[[nodiscard]] BusSettings BusSettingsOf(const BusConfig& config, PulseLines* lines);
// How its recording names the kind of bus.
[[nodiscard]] WireLog::Kind WireKindOf(const BusConfig& config);
// Whether its driver handles passwords.
[[nodiscard]] bool HoldsSecrets(const BusConfig& config);

}  // namespace axlecast
