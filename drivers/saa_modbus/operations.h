#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/saa_modbus/procedures.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

[[nodiscard]] std::span<const OperationSpec> Operations();
// Whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);

// Returns whether the command may find the encoder at another address or baud rate than the file's: it is allowed even
// if the encoder does not answer.
[[nodiscard]] bool LooksElsewhere(const DriverCommand& command);
// Returns whether an operation writes the encoder's memory.
[[nodiscard]] bool Writes(std::string_view operation);

// The parts of the device and its bus that a procedure uses. They outlive the procedure.
struct OperationContext {
  const SaaModbusSettings& settings;
  const DeviceOutput& output;
  Connection& connection;
  const std::vector<std::uint8_t>& other_addresses;  // of the bus's other configured encoders
};

// Returns the procedure that carries out a command, or an error with a REASON_* if an argument is wrong or the bus
// forbids it.
[[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                               const OperationContext& context);

}  // namespace axlecast::saa_modbus
