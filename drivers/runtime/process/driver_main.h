#pragma once

#include <functional>
#include <memory>

#include "core/config/machine_config.h"
#include "core/device/family.h"
#include "core/device/link.h"
#include "core/messages/message.h"

namespace axlecast {

// Wrappers around the line and the command port of a driver, for tests. Empty: no wrapper.
struct DriverInterposers {
  std::function<std::unique_ptr<ByteLink>(ByteLink&)> link;
  std::function<std::unique_ptr<MessageSink>(MessageSink&)> commands;
};

// Runs the driver of one bus until SIGTERM or SIGINT. Returns the exit code of the process: 0 after a clean stop, 1 if LCM
// cannot be used or another process has the line. If the port is missing, the driver waits for it.
[[nodiscard]] int RunDriver(const MachineConfig& machine, const BusConfig& bus, bool verbose,
                            const DriverInterposers& interposers);

// The main function of a family's driver program: `--config FILE --bus NAME`. Returns the exit code of the process: that of
// RunDriver, 1 for an error in the configuration, 2 for an error on the command line. See docs/driver.md.
[[nodiscard]] int DriverMain(const Family& family, int argc, char** argv,
                             const DriverInterposers& interposers = {});

}  // namespace axlecast
