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

// The ports of drivers/hal that a bus uses.
struct Ports {
  std::unique_ptr<ByteLink> link;     // this one, or `frames`
  std::unique_ptr<FrameLink> frames;  // of a CAN bus
  std::unique_ptr<PulseLines> lines;  // null: the family uses no lines
  std::function<std::vector<std::string>()> warnings;
};

// Makes the ports without opening them. `clock` outlives the ports.
[[nodiscard]] Ports MakePorts(const MachineConfig& machine, const BusConfig& bus, const Clock& clock);

// Returns the settings of a configured bus. On a bus with several devices, a silent device is paused for longer while
// others answer, because its timeouts take slots from them. While no device answers, each is polled at least every 100 ms.
[[nodiscard]] BusSettings BusSettingsOf(const BusConfig& config, PulseLines* lines);
// Returns the kind of bus for its recording.
[[nodiscard]] WireLog::Kind WireKindOf(const BusConfig& config);
// Returns true if the driver of this bus handles passwords.
[[nodiscard]] bool HoldsSecrets(const BusConfig& config);

}  // namespace axlecast
