#pragma once

#include <functional>
#include <memory>

#include "core/config/machine_config.h"
#include "core/device/family.h"
#include "core/device/link.h"
#include "core/messages/message.h"

namespace axlecast {

// What stands between the driver and its line and command port. Empty ones: nothing does.
struct DriverInterposers {
  std::function<std::unique_ptr<ByteLink>(ByteLink&)> link;
  std::function<std::unique_ptr<MessageSink>(MessageSink&)> commands;
};

// Runs the driver of one bus until SIGTERM or SIGINT. Returns the process's exit code: 0 after a clean stop, 1 when
// LCM cannot be used (any more), or when another process has the line. A missing port is a state, not an exit.
[[nodiscard]] int RunDriver(const MachineConfig& machine, const BusConfig& bus, bool verbose,
                            const DriverInterposers& interposers);

// The main function of a family's driver program: `--config FILE --bus NAME`. Returns the process's exit code: as
// RunDriver, also 1 for a mistake in the configuration and 2 for one on the command line. See docs/driver.md.
[[nodiscard]] int DriverMain(const Family& family, int argc, char** argv,
                             const DriverInterposers& interposers = {});

}  // namespace axlecast
