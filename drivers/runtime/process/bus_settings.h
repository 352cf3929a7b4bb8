#pragma once

#include "core/config/machine_config.h"
#include "drivers/runtime/bus/bus.h"

namespace axlecast {

// How a configured bus is run. On a bus with several devices a silent one pauses for longer while others answer,
// because its timeouts cost them their turns. While no device answers, each is asked again within 100 ms of its turn.
[[nodiscard]] BusSettings BusSettingsOf(const BusConfig& config, PulseLines* lines);
// How its recording names the kind of bus.
[[nodiscard]] WireLog::Kind WireKindOf(const BusConfig& config);
// Whether its driver handles passwords.
[[nodiscard]] bool HoldsSecrets(const BusConfig& config);

}  // namespace axlecast
