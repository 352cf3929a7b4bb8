#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/base/clock.h"
#include "core/config/machine_config.h"
#include "core/device/byte_link.h"
#include "core/device/frame_link.h"
#include "core/device/pulse_lines.h"

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

}  // namespace axlecast
