#pragma once

#include <optional>
#include <string>

#include "drivers/runtime/config/machine_config.h"
#include "drivers/runtime/core/inline_bytes.h"

namespace axlecast {

// The machine's file that a log begins with: a recorder writes it before all that it hears. Nothing where there is none
// or it cannot be used; `problem` then says why. `file`: the log's name, for that.
[[nodiscard]] std::optional<MachineConfig> MachineOf(Bytes log, const std::string& file, std::string& problem);

}  // namespace axlecast
