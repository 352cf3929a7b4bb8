#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/kit/refusal.h"
#include "drivers/saa_can/procedures.h"
#include "drivers/saa_can/settings.h"

namespace axlecast::saa_can {

// Of the family: those of SAA encoders, then those that only cia406 has.
[[nodiscard]] std::span<const OperationSpec> Operations();
// Whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);
// Of an SAA encoder; null for another name.
[[nodiscard]] const OperationSpec* FindOperation(std::string_view name);

// The encoder may be where the file does not say: allowed even when it is not heard.
[[nodiscard]] bool LooksElsewhere(const DriverCommand& order);

// Why the operation cannot be told from a position where the shaft stands: counts as MotionAt has them.
[[nodiscard]] std::optional<Outcome> RefusalAtPosition(std::string_view operation, std::int64_t counts,
                                                       const SaaCanSettings& settings);

// The procedure that carries out an order, or why there is none: arguments are checked here.
[[nodiscard]] Made<Procedure> MakeProcedure(const DriverCommand& order, const OperationContext& around, MonoNs now);

}  // namespace axlecast::saa_can
