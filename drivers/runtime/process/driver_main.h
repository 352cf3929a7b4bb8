#pragma once

#include "core/device/family.h"
#include "drivers/runtime/process/run_driver.h"

namespace axlecast {

// The main function of a family's driver program: `--config FILE --bus NAME`. Returns the process's exit code: as
// RunDriver, also 1 for a mistake in the configuration and 2 for one on the command line. See docs/driver.md.
[[nodiscard]] int DriverMain(const Family& family, int argc, char** argv,
                             const DriverInterposers& interposers = {});

}  // namespace axlecast
