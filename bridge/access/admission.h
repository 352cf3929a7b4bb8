#pragma once

#include <axlecast/command_body_t.hpp>
#include <cstdint>
#include <variant>

#include "bridge/access/authority.h"
#include "core/base/time.h"
#include "core/command/operation_check.h"
#include "core/config/machine_config.h"

namespace axlecast {

// A command that this bridge may take up: where it goes and what it does.
struct Admitted {
  const BusConfig* bus = nullptr;
  const OperationSpec* operation = nullptr;
  MonoNs begin_by = 0;
};

// Whether a command (any mode but QUERY) of `caller` may be taken up, by what it says alone. What is refused once is
// refused for as long as the bridge runs, so that it need not be remembered.
[[nodiscard]] std::variant<Admitted, Refusal> Admit(const MachineConfig& machine, std::int64_t bridge_boot_id,
                                                    const Authority& authority, const Caller& caller,
                                                    const command_body_t& body, MonoNs now);

}  // namespace axlecast
