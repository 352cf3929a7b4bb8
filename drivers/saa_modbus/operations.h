#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/kit/refusal.h"
#include "drivers/saa_modbus/procedures.h"
#include "drivers/saa_modbus/settings.h"

namespace axlecast::saa_modbus {

[[nodiscard]] std::span<const OperationSpec> Operations();
// Whether the configuration of a device permits an operation of the family.
[[nodiscard]] bool Permits(const BusConfig& bus, const DeviceConfig& device, std::string_view operation);
// It names an operation of the table above.
[[nodiscard]] const OperationSpec* FindOperation(std::string_view name);

// The encoder may be where the file does not say: allowed even when it does not answer.
[[nodiscard]] bool LooksElsewhere(const DriverCommand& order);
// It writes the encoder's memory.
[[nodiscard]] bool Writes(std::string_view operation);

// What a procedure may know of the device and its bus. Outlives the procedure.
struct OperationContext {
  const SaaModbusSettings& settings;
  const DeviceOutput& output;
  Connection& connection;
  const std::vector<std::uint8_t>& other_addresses;  // of the bus's other configured encoders
};

// The procedure that carries out an order, or why there is none: arguments are checked here.
[[nodiscard]] Made<Procedure> MakeProcedure(const DriverCommand& order, const OperationContext& around);

}  // namespace axlecast::saa_modbus
