#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "core/base/result.h"
#include "core/device/operation.h"
#include "drivers/saa_modbus/procedures.h"

namespace axlecast::saa_modbus {

[[nodiscard]] std::span<const OperationSpec> Operations();
// Returns whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);

// Returns whether the command may find the encoder at another address or baud rate than the file's: it is allowed even
// if the encoder does not answer.
[[nodiscard]] bool LooksElsewhere(const DriverCommand& command);
// Returns whether an operation writes the encoder's memory.
[[nodiscard]] bool Writes(std::string_view operation);

// Returns the procedure that carries out a command, or an error with a REASON_* if an argument is wrong or the bus
// forbids it.
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                               const OperationContext& context);

}  // namespace axlecast::saa_modbus
