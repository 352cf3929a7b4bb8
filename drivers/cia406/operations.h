#pragma once

#include <memory>

#include "core/base/result.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/cia406/interpreter.h"
#include "drivers/cia406/procedures.h"
#include "drivers/cia406/settings.h"

namespace axlecast::cia406 {

// Returns the procedure that carries out a command, or an error if an argument is wrong.
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                               const Cia406Settings& settings,
                                                               const Interpreter& interpreter,
                                                               const DeviceOutput& output, MonoNs now);

}  // namespace axlecast::cia406
