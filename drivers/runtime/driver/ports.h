#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/runtime/config/machine_config.h"
#include "drivers/runtime/core/byte_link.h"
#include "drivers/runtime/core/clock.h"
#include "drivers/runtime/core/frame_link.h"
#include "drivers/runtime/core/pulse_lines.h"

namespace axlecast {

// What of drivers/io carries a bus.
struct Ports {
  std::unique_ptr<ByteLink> link;     // one of these two
  std::unique_ptr<FrameLink> frames;  // of a CAN bus
  std::unique_ptr<PulseLines> lines;  // null: the family uses none
  std::function<std::vector<std::string>()> warnings;
};

// Opens nothing yet. `clock` outlives the ports.
[[nodiscard]] Ports MakePorts(const MachineConfig& machine, const BusConfig& bus, const Clock& clock);

}  // namespace axlecast
