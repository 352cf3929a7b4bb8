#pragma once

#include <memory>
#include <string_view>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/cia406/interpreter.h"
#include "drivers/cia406/procedures.h"
#include "drivers/cia406/settings.h"
#include "drivers/kit/refusal.h"

namespace axlecast::cia406 {

// Whether the operation moves the datum.
[[nodiscard]] bool MovesDatum(std::string_view operation);

// The procedure that carries out an order, or why there is none.
[[nodiscard]] Made<Procedure> MakeProcedure(const DriverCommand& order, const Cia406Settings& settings,
                                            const Interpreter& interpreter, const DeviceOutput& output, MonoNs now);

}  // namespace axlecast::cia406
