#pragma once

#include "drivers/runtime/core/family.h"
#include "drivers/runtime/driver/run_driver.h"

namespace axlecast {

// The main function of a family's driver program: `--config FILE --bus NAME`. Returns the process's exit code: as
// RunDriver, also 1 for a mistake in the configuration and 2 for one on the command line. See docs/driver.md.
[[nodiscard]] int DriverMain(const Family& family, int argc, char** argv,
                             const DriverInterposers& interposers = {});

}  // namespace axlecast
