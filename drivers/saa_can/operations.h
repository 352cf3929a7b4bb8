#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "drivers/runtime/core/device.h"
#include "drivers/runtime/core/operation.h"
#include "drivers/saa_can/procedure.h"
#include "drivers/saa_can/settings.h"

namespace axlecast::saa_can {

// Of the family: those of SAA encoders, then those that only cia406 has.
[[nodiscard]] std::span<const OperationSpec> Operations();
// Of an SAA encoder; null for another name.
[[nodiscard]] const OperationSpec* FindOperation(std::string_view name);

// The encoder may be where the file does not say: allowed even when it is not heard.
[[nodiscard]] bool LooksElsewhere(const Order& order);

// What a procedure may know of the device. Outlives the procedure.
struct Surroundings {
  const SaaCanSettings& settings;
  bool bench = false;
  const Interpreter& interpreter;
  const DeviceOutput& output;
};

// The procedure that carries out an order, or why there is none: arguments are checked here.
[[nodiscard]] std::variant<std::unique_ptr<Procedure>, Outcome> MakeProcedure(const Order& order,
                                                                              const Surroundings& around,
                                                                              MonoNs now);

}  // namespace axlecast::saa_can
