#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_serial/procedure.h"
#include "drivers/saa_serial/settings.h"

namespace axlecast::saa_serial {

inline constexpr std::string_view kZeroName = "zero";
inline constexpr std::string_view kReadPositionName = "read_position";

[[nodiscard]] std::span<const OperationSpec> Operations();
// Whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);

// Returns the procedure for a command. Checks its arguments.
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command, const SaaBus& bus,
                                                               const SaaSettings& settings,
                                                               const DeviceOutput& output, MonoNs now);

}  // namespace axlecast::saa_serial
