#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/saa_can/procedures.h"
#include "drivers/saa_can/settings.h"

namespace axlecast::saa_can {

// Returns the operations of the family: those of SAA encoders, then those that only cia406 has.
[[nodiscard]] std::span<const OperationSpec> Operations();
// Returns whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);
// Returns an operation of SAA encoders; null for another name.
[[nodiscard]] const OperationSpec* FindOperation(std::string_view name);

// Returns whether the command is allowed while nothing is received from the encoder: it may have another node id or bit
// rate than the configuration.
[[nodiscard]] bool LooksElsewhere(const DriverCommand& command);

// Returns an error if the reply to the operation could not be distinguished from the position of the shaft. `counts` is
// Motion::counts.
[[nodiscard]] Result<> CheckPosition(std::string_view operation, std::int64_t counts,
                                     const SaaCanSettings& settings);

// Returns the procedure that carries out a command, or an error if an argument is wrong or the configuration forbids it.
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                               const OperationContext& context, MonoNs now);

}  // namespace axlecast::saa_can
