#pragma once

#include <axlecast/command_body_t.hpp>
#include <cstdint>
#include <variant>

#include "drivers/runtime/command/operation_check.h"
#include "drivers/runtime/config/machine_config.h"

namespace axlecast {

// A command that this bridge may take up: where it goes and what it does.
struct Admitted {
  const BusConfig* bus = nullptr;
  const DeviceConfig* device = nullptr;
  const OperationSpec* operation = nullptr;
};

// Whether a command (any mode but QUERY) may be taken up, by what it says alone, whoever sent it. The answer never
// changes while the bridge runs, so that a refused one need not be remembered.
[[nodiscard]] std::variant<Admitted, Refusal> Admit(const MachineConfig& machine, std::int64_t bridge_boot_id,
                                                    const command_body_t& body);

}  // namespace axlecast
