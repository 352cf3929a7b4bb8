#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/config/machine_config.h"
#include "core/device/line_settings.h"
#include "core/device/link.h"
#include "drivers/runtime/bus/bus.h"

namespace axlecast {

// What of drivers/hal carries a bus.
struct Ports {
  std::unique_ptr<ByteLink> link;     // one of these two
  std::unique_ptr<FrameLink> frames;  // of a CAN bus
  std::unique_ptr<PulseLines> lines;  // null: the family uses none
  std::function<std::vector<std::string>()> warnings;
};

// Opens nothing yet. `clock` outlives the ports.
[[nodiscard]] Ports MakePorts(const MachineConfig& machine, const BusConfig& bus, const Clock& clock);

// How a configured bus is run. On a bus with several devices a silent one pauses for longer while others answer,
// because its timeouts cost them their turns. While no device answers, each is asked again within 100 ms of its turn.
[[nodiscard]] BusSettings BusSettingsOf(const BusConfig& config, PulseLines* lines);
// How its recording names the kind of bus.
[[nodiscard]] WireLog::Kind WireKindOf(const BusConfig& config);
// Whether its driver handles passwords.
[[nodiscard]] bool HoldsSecrets(const BusConfig& config);

}  // namespace axlecast
